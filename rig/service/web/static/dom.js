// Small helpers: elements by id, texts, numbers, requests. Texts are only ever set as text.

export const by = (id) => document.getElementById(id);

export function put(id, text) {
  const element = by(id);
  if (element.textContent !== text) element.textContent = text;
}

export function show(id, wanted) { by(id).hidden = !wanted; }

export const shown = (value, digits, unit = "") =>
  value === null || value === undefined ? "–" : value.toFixed(digits) + (unit ? " " + unit : "");

export const seconds = (value) => {
  const s = Math.round(value);
  return s < 60 ? `${s} s` : s < 3600 ? `${Math.floor(s / 60)} min ${s % 60} s` : `${Math.floor(s / 3600)} h ${Math.floor(s / 60) % 60} min`;
};

// An element with its texts and children: make("p", {class: "x"}, "text", child)
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

export function fill(id, ...children) { by(id).replaceChildren(...children); }

// A number that a person wrote, with a point or a comma; NaN when it is none.
export const parsed = (text) => (/^\s*[-+]?(\d+([.,]\d*)?|[.,]\d+)\s*$/.test(text) ? Number(text.trim().replace(",", ".")) : NaN);

const formKey = document.body.dataset.formKey;

// What the server answers as data; throws with its one line.
export async function ask(path, body, patience = 60000) {
  const request = { headers: { Accept: "application/json" }, signal: AbortSignal.timeout(patience) };
  if (body !== undefined) {
    request.method = "POST";
    request.headers["Content-Type"] = "application/json";
    request.body = JSON.stringify({ ...body, form_key: formKey });
  }
  let answer;
  try {
    answer = await fetch(path, request);
  } catch {
    throw new Error("the page's server does not answer");
  }
  const text = await answer.text();
  let data;
  try { data = JSON.parse(text); } catch { data = { error: text.trim() }; }
  if (!answer.ok) throw new Error(data.error || data.said || `refused (${answer.status})`);
  return data;
}
