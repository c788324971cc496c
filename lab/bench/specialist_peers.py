#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The eight networks of the thesis in python3-torch, and one Levenberg-Marquardt training in SciPy.

Needs the Debian packages python3-torch and python3-scipy; only this script of the project does. Run it next to
loopwarden_bench, on the same idle machine, and divide.
"""
import time

import numpy as np
import torch
from scipy.optimize import least_squares

SIDE = 31
HIDDEN = (10, 20, 31, 10, 20, 20, 10, 20)


def network(hidden):
    return torch.nn.Sequential(
        torch.nn.Linear(SIDE, hidden), torch.nn.Tanh(),
        torch.nn.Linear(hidden, hidden), torch.nn.Tanh(),
        torch.nn.Linear(hidden, SIDE)).eval()


def torch_median_us():
    torch.set_num_threads(1)
    networks = [network(h) for h in HIDDEN]
    window = torch.rand(SIDE, SIDE)
    target = torch.rand(SIDE, SIDE)
    times = []
    with torch.inference_mode():
        for _ in range(300):
            start = time.perf_counter()
            for net in networks:
                torch.mean((net(window) - target) ** 2)
            times.append(time.perf_counter() - start)
    return 1e6 * float(np.median(times))


def scipy_seconds(hidden=10, cases=15 * SIDE, evaluations=20):
    """Seconds for one step of least_squares on a 31-10-10-31 network; its Jacobian is by differences."""
    rng = np.random.default_rng(1)
    inputs = rng.uniform(-1, 1, (SIDE, cases))
    targets = rng.uniform(-1, 1, (SIDE, cases))
    shapes = [(hidden, SIDE), (hidden,), (hidden, hidden), (hidden,), (SIDE, hidden), (SIDE,)]
    sizes = [int(np.prod(s)) for s in shapes]

    def residuals(w):
        parts, at = [], 0
        for shape, size in zip(shapes, sizes):
            parts.append(w[at:at + size].reshape(shape))
            at += size
        z1 = np.tanh(parts[0] @ inputs + parts[1][:, None])
        z2 = np.tanh(parts[2] @ z1 + parts[3][:, None])
        return (parts[4] @ z2 + parts[5][:, None] - targets).ravel()

    start_weights = rng.normal(0, 0.3, sum(sizes))
    start = time.perf_counter()
    result = least_squares(residuals, start_weights, method="trf", max_nfev=evaluations)
    return (time.perf_counter() - start) / max(1, result.njev)


if __name__ == "__main__":
    print(f"torch {torch.__version__}: eight networks, one window, median {torch_median_us():.0f} us")
    print(f"SciPy least_squares, 31-10-10-31 on 465 cases: {scipy_seconds(evaluations=2):.1f} s per epoch")
