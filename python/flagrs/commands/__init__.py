"""The commands that look at files of runs, a file each; `flagrs.cli` has those that run scenes."""
