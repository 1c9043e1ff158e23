"""``python -m truearm`` is the command ``truearm``."""

from truearm.cli import main

main()
