"""`python -m energymargin` is the command `energymargin`."""

from energymargin.cli import main

if __name__ == "__main__":
    main()
