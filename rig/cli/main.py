"""Where `pamrig` begins: Ctrl-C is heard before anything is imported that takes time. Python's own start comes before
that, and ends by the signal."""

# what `signal` stands on, which itself imports much; this is in every interpreter, and known to no type checker
import _signal  # type: ignore[import-not-found]
import os


def main() -> None:
    """Everything that `pamrig` does. Until that can be interrupted in order, Ctrl-C ends it on the spot."""
    is_heard = _signal.getsignal(_signal.SIGINT) is _signal.default_int_handler  # it is ignored in a shell's background
    if is_heard:
        _signal.signal(_signal.SIGINT, lambda *_: os._exit(130))
    from rig.cli.ctrl_c import carry_out_interruptibly

    carry_out_interruptibly(is_heard)


if __name__ == "__main__":
    main()
