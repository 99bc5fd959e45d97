"""`python -m recoil`: the command line where its script is not on the path."""

from recoil.cli import main

if __name__ == "__main__":  # processes that are started from here read this as well
    main()
