"""``hsbench doctor``."""

from __future__ import annotations

import click

from hsbench.cli.common import json_option, print_json


@click.command(epilog="Example: hsbench doctor", short_help="what this machine has and lacks")
@json_option
@click.pass_context
def command(context: click.Context, as_json: bool) -> None:
    """Say what this machine has and lacks for each part of hsbench, and what to do about it."""
    from hsbench.cli.doctor import examine

    findings = examine()
    if as_json:
        print_json([{"item": f.item, "state": f.state, "found": f.found, "advice": f.advice} for f in findings])
    else:
        width = max(len(f.item) for f in findings)
        for f in findings:
            click.echo(
                f"{f.state:<8}{f.item:<{width + 2}}{f.found}"
                + (f"\n{'':<8}{'':<{width + 2}}-> {f.advice}" if f.advice else "")
            )
    context.exit(2 if any(f.state == "broken" for f in findings) else 0)
