"""Who called a command that runs: Ctrl-C and its like, also before there is a session."""

import signal

from rig.service.session.session import Session


class GivenUp(Exception):
    """The operator asked to stop before the rig was open."""


class Operator:
    """Ctrl-C: the first ramps down and finishes the file, the second is an emergency stop. Listens before there is a
    session."""

    def __init__(self) -> None:
        self._session: Session | None = None
        self.asked_to_stop = False
        self.presses = 0
        """How often he has asked for the end; a terminal that is gone asks for nothing more than the first stop."""

    def command(self, session: Session) -> None:
        """From now on this session is stopped."""
        self._session = session
        if self.asked_to_stop:
            session.mailbox.stop()

    def check(self) -> None:
        """GivenUp once he has asked: a device that does not answer is not waited for any more."""
        if self.asked_to_stop:
            raise GivenUp

    def signalled(self, number: int, _: object) -> None:
        """The handler of the signals by which he asks."""
        again, self.asked_to_stop = self.asked_to_stop, True
        self.presses += number != signal.SIGHUP
        if self._session is not None:
            if again and number == signal.SIGINT:
                self._session.mailbox.estop()
            self._session.mailbox.stop()
