"""The commands of the studies: many runs of one scene."""
