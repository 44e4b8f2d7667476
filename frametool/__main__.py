"""`python -m frametool`, if the console script is not on the path."""

from frametool.cli import main

main()
