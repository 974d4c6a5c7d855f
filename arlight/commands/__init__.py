"""The command line: one file a subcommand, its options as a dataclass and the function that runs it."""
