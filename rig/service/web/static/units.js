// What input and output of a rig are called, and their units: two pressures and an angle, or names of its own.
import { line } from "./plots.js";

export const rig = JSON.parse(document.body.dataset.units);

export const inputAxis = (units) => `${units.input}${units.valves ? " set-points" : ""} [${units.input_unit}]`;
export const outputAxis = (units) => `${units.output} [${units.output_unit}]`;

export const setPointLines = (units) => (units.valves
  ? [line("p1 set-point", 0, [4, 4]), line("p1", 0), line("p2 set-point", 1, [4, 4]), line("p2", 1)]
  : [line(units.input, 0)]);
export const setPointColumns = (units) => (units.valves ? ["p1_cmd_mpa", "p1_mpa", "p2_cmd_mpa", "p2_mpa"] : ["input"]);
