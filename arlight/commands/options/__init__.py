"""What the subcommands take from the command line, one module each, named like the one that does the work.

Options are dataclasses of plain values, so that help and refusals come without loading what does the work.
"""
