"""From options to the module that does what they ask for, which is loaded only then."""

from importlib import import_module


def run_command(options: object) -> int:
    """Run the subcommand whose options these are: the module of the same name in `arlight.commands`.

    Raises:
        ArlightError: something the user can mend.
    """
    name = type(options).__module__.rpartition(".")[2]
    return int(import_module(f"arlight.commands.{name}").run(options))
