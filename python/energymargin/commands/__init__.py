"""The commands of `energymargin`, a file each; the command line itself is `cli`."""
