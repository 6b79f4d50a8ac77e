"""The command line: options, tables, exit codes, and nothing else. What a command does stands in `rig.app`. A module or
a folder a group of commands; `commands.py` has the table of all."""
