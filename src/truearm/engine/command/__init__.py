"""What the jobs and commands of several features are given: arguments, options, data and their split."""
