"""The robot: chain of elementary transforms, conventions, parameters, joint effects."""

import numpy as np

# Importing this lets the process keep the memory of arrays it is done with. The C library of Linux returns every
# block above 128 kB to the system and gets it back page by page, which takes longer than sweeping 1000
# configurations. It raises that limit to the size of what it sees freed, at most 32 MiB (mallopt(3),
# M_MMAP_THRESHOLD), so one block, freed without ever being touched, is enough. Elsewhere this does nothing.
np.empty(4_000_000)
