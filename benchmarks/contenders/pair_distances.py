"""truearm: errors of all distances between 9905 points, beside SciPy's pdist, which makes the distances alone."""

from __future__ import annotations

import resource

import numpy as np
import scipy
from scipy.spatial.distance import pdist
from stopwatch import median_seconds, report

import truearm
from truearm.validation.distances import pair_distances

rng = np.random.default_rng(0)
measured = rng.uniform(-0.6, 0.6, (9905, 3))
predicted = measured * 1.0003 + rng.normal(0, 2e-4, measured.shape)
figures: dict[str, object] = {
    "pairs": pair_distances(predicted, measured).pairs,
    "seconds": median_seconds(lambda: pair_distances(predicted, measured), 5),
    # Of the whole process up to here, NumPy and SciPy included; pdist makes 392 MB after this [bytes].
    "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024,
}
room = np.empty(len(measured) * (len(measured) - 1) // 2)
figures["pdist_seconds"] = median_seconds(lambda: pdist(measured, out=room), 5)
report(figures, {"truearm": truearm.__version__, "numpy": np.__version__, "scipy": scipy.__version__})
