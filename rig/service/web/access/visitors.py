"""Who looks at the page: signed cookies, the token with its limit on guessing, and the key in every form. No HTTP
here."""

import hashlib
import hmac
import secrets
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

COOKIE: Final = "pamrig_page"
LASTS_S: Final = 30 * 86400
"""A login lasts so long, s: thirty days."""
GUESSES: Final = 5
"""Wrong tokens from one address, and for all addresses ten times as many, before the next must wait."""
FORGET_S: Final = 60.0
"""After so long a wrong token is forgotten."""
_EVERYBODY: Final = 10
_ADDRESSES: Final = 1024


@dataclass(frozen=True)
class Visitor:
    """One browser."""

    id: str
    trusted: bool
    """It has shown the token."""

    @property
    def name(self) -> str:
        """What the others see of it: nothing that could be used in its place."""
        return hashlib.sha256(self.id.encode()).hexdigest()[:4]


class Visitors:
    """Makes and recognises visitors. What is signed is void once key or token are others."""

    def __init__(self, key: bytes, token: str, clock: Callable[[], float] = time.monotonic) -> None:
        """`clock`: seconds by which a login grows old. Not the machine's date: who turns it would log everybody out,
        and Stop with them."""
        self._key = hmac.digest(key, token.encode(), "sha256")
        self._token, self._clock = token.encode(), clock

    def new(self, *, trusted: bool) -> Visitor:
        """A browser that comes for the first time, or has just shown the token."""
        return Visitor(secrets.token_hex(12), trusted)

    def cookie(self, visitor: Visitor) -> str:
        """What the browser is to show the next time."""
        text = f"{visitor.id}.{int(visitor.trusted)}.{int(self._clock())}"
        return f"{text}.{self._sign('cookie', text)}"

    def recognised(self, cookie: str) -> Visitor | None:
        """Whose cookie it is; None for one that was not made here, or too long ago."""
        text, _, signature = cookie.rpartition(".")
        if not hmac.compare_digest(signature.encode(), self._sign("cookie", text).encode()):
            return None
        id_, trusted, made = text.split(".")
        return Visitor(id_, trusted == "1") if self._clock() - int(made) < LASTS_S else None

    def form_key(self, visitor: Visitor) -> str:
        """What a form of this visitor's page carries, so that no other page can send it."""
        return self._sign("form", visitor.id)

    def is_form_key(self, visitor: Visitor, given: str) -> bool:
        """Compared in constant time."""
        return hmac.compare_digest(given.encode(), self.form_key(visitor).encode())

    def token_fits(self, given: str) -> bool:
        """Compared in constant time; nothing fits when there is no token."""
        sealed, wanted = (hmac.digest(self._key, text, "sha256") for text in (given.encode(), self._token))
        return hmac.compare_digest(sealed, wanted) and bool(self._token)

    def _sign(self, what: str, text: str) -> str:
        return hmac.new(self._key, f"{what}:{text}".encode(), "sha256").hexdigest()


class Guesses:
    """Counts wrong tokens. Who has no guess left waits, whatever he shows; who sits before a logged-in page does
    not."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._wrong: OrderedDict[str, list[float]] = OrderedDict()

    def wait_s(self, address: str) -> float:
        """How long this address has to wait before it may show a token; 0: not at all."""
        now = self._clock()
        own = [at for at in self._wrong.get(address, []) if now - at < FORGET_S]
        everybody = sorted(at for times in self._wrong.values() for at in times if now - at < FORGET_S)
        waits = [times[-most] + FORGET_S - now for times, most in self._limits(own, everybody) if len(times) >= most]
        return max([0.0, *waits])

    def wrong(self, address: str) -> None:
        """One more wrong token."""
        now = self._clock()
        times = [at for at in self._wrong.pop(address, []) if now - at < FORGET_S]
        self._wrong[address] = [*times, now][-GUESSES:]
        if len(self._wrong) > _ADDRESSES:
            self._wrong.popitem(last=False)

    def _limits(self, own: list[float], everybody: list[float]) -> tuple[tuple[list[float], int], ...]:
        return (own, GUESSES), (everybody, GUESSES * _EVERYBODY)
