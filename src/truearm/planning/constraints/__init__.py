"""Where an arm may be measured."""
