"""A pose from six lengths: one ballbar between three cups on the base and three on the tool (Nubiola, chapter 3)."""
