"""Where `pamrig` begins: nothing of it is imported before Ctrl-C is heard."""

import sys


def main() -> None:
    """`rig.cli.commands.main`; Ctrl-C while that and its packages are being imported ends as quietly as it does
    later."""
    try:
        from rig.cli.commands import main as carry_out

        carry_out()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
