"""What is loaded when: nothing dear before it is asked for, and all of it then."""

import inspect
import subprocess
import sys

import pytest
from typer.testing import CliRunner

import axisight
from axisight.cli import app
from axisight.cli.application import _COMMANDS, load_command

# Libraries that take longer to load than a command takes to answer.
DEAR = ("dask", "matplotlib", "pandas", "scipy", "xarray", "zarr")


def loaded_by(code: str) -> set[str]:
    """The dear libraries that a program has loaded at its end."""
    report = f"\nimport sys; print(*(n for n in {DEAR!r} if n in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code + report], capture_output=True, check=True)
    return set(done.stdout.decode().splitlines()[-1].split())


def test_everything_named_is_there():
    for name in axisight.__all__:
        assert getattr(axisight, name) is not None
    assert set(axisight.__all__) <= set(dir(axisight))
    assert axisight.__version__.count(".") == 2


def test_what_is_not_there_is_said():
    with pytest.raises(AttributeError, match="no_such_thing"):
        _ = axisight.no_such_thing


def test_the_package_loads_nothing_dear():
    assert loaded_by("import axisight") == set()
    # The other way round: what is asked for comes with its libraries.
    assert "xarray" in loaded_by("import axisight; axisight.simulate")


def test_help_loads_nothing_dear():
    code = "from typer.testing import CliRunner as R; from axisight.cli import app\n"
    assert loaded_by(code + "assert 'diagnose' in R().invoke(app, ['--help']).output") == set()


def test_a_diagnosis_loads_no_plots():
    assert not loaded_by("import axisight.cli.diagnose") & {"dask", "matplotlib", "zarr"}


@pytest.mark.parametrize("name", _COMMANDS)
def test_the_list_of_commands_says_what_they_say(name):
    command = load_command(name)
    assert inspect.cleandoc(command.help or "").splitlines()[0] == _COMMANDS[name][2]
    helped = CliRunner().invoke(app, [name, "--help"])
    assert helped.exit_code == 0
    assert f" {name} " in helped.output.split("Usage:")[1].split("\n")[0]


def test_the_version():
    assert CliRunner().invoke(app, ["--version"]).output.strip() == axisight.__version__
