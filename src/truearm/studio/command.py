"""``truearm studio``."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from truearm.engine.base.errors import InputError
from truearm.engine.command.options import print_line, progress


def studio(
    folder: Annotated[
        Path, typer.Argument(metavar="[FOLDER]", help="Of the project; made where it is missing.")
    ] = Path("truearm-project"),
    demo: Annotated[
        bool, typer.Option("--demo", help="Fill an empty folder with a twin of an ABB IRB 120, its data and a program.")
    ] = False,
    port: Annotated[int, typer.Option(metavar="N", help="To listen on; 0 for any that is free.")] = 8080,
    host: Annotated[
        str, typer.Option(metavar="HOST", help="Address to listen on; others than loopback need a token.")
    ] = "127.0.0.1",
    token: Annotated[
        str | None,
        typer.Option(metavar="TOKEN", help="What a browser must bring.", show_default="made where it is needed"),
    ] = None,
    no_open: Annotated[bool, typer.Option("--no-open", help="Do not open the browser.")] = False,
) -> None:
    """Open a project in the browser: robot, measurements, calibration, proof and programs. Ctrl-C ends it."""
    if find_spec("viser") is None:
        raise InputError(
            "the studio needs the extra truearm[studio]",
            where="truearm studio",
            cure="Install it: pip install 'truearm[studio]'.",
        )
    from truearm.engine.base.parts import is_loopback
    from truearm.studio.serving import serve

    tunnel = f"ssh -L {port}:127.0.0.1:{port} THIS-MACHINE"
    with progress() as say:
        served = serve(
            folder,
            host=host,
            port=port,
            token=token,
            demo=demo,
            say=lambda text: print_line(f"truearm studio: {text}", err=True),
            progress=say,
        )
    try:
        if not is_loopback(host):
            print_line(
                "Whoever reaches this machine and has the token can read and change the project, and nothing that is "
                f"sent is encrypted. An SSH tunnel is the better way: leave out --host, and open {tunnel}.",
                err=True,
            )
        print_line(f"The studio of {served.window.project.folder} is at {served.access.entrance} until Ctrl-C.")
        if not no_open:
            import webbrowser

            webbrowser.open(served.access.entrance)
        served.wait()
    finally:
        served.stop()
