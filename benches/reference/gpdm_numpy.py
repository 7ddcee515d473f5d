"""The loss of crates/track/src/motion_model/gpdm/objective.rs with its gradient, and predictions, in NumPy and SciPy, for comparison of times.

The workload is identical to that of benches/gpdm.rs. Run with one thread:

    OPENBLAS_NUM_THREADS=1 python benches/reference/gpdm_numpy.py

Checks the gradient against central differences; prints loss and gradient norm (to compare with the Rust program) and the
fastest of many samples.
"""

import argparse
import time

import numpy as np
from scipy.linalg import cho_factor, lapack, solve_triangular

DIMENSIONS, LATENTS, PARTICLES = 60, 3, 1000
SCALE_PRIOR_VARIANCE = 1e6


def motion(frames):
    """A motion of slowly drifting cycles of 65 frames, like a walk at 60 Hz."""
    i, j = np.arange(frames)[:, None], np.arange(DIMENSIONS)[None, :]
    phase = i * 2 * np.pi / 65
    drift = 1 + 0.2 * np.sin(i * 0.013 + j)
    swing = drift * np.sin(phase + 0.7 * j) * (0.1 + 0.005 * j)
    return swing + 0.05 * np.cos(2 * phase + 0.3 * j)


def start(frames):
    """Latents column by column, then the logarithms of beta2, beta3, alpha1 to alpha4."""
    i, c = np.arange(frames)[:, None], np.arange(LATENTS)[None, :]
    latents = np.sin(i * 0.0967 + c * 1.6) * 1.4
    return np.concatenate([latents.T.ravel(), np.log([1.0, 50.0, 0.1, 1.0, 0.9, 50.0])])


def squared_distances(a, b):
    """Squared distances of all pairs of rows, by expanding the square: a single matrix product."""
    squared = (a * a).sum(1)[:, None] + (b * b).sum(1)[None, :] - 2 * a @ b.T
    return np.maximum(squared, 0, out=squared)


def inverse(covariance):
    """Inverse and logarithm of the determinant of a symmetric positive definite matrix."""
    factor, info = lapack.dpotrf(covariance, lower=1, clean=0)
    if info != 0:
        raise np.linalg.LinAlgError("not positive definite")
    log_determinant = 2 * np.log(factor.diagonal()).sum()
    inverted, _ = lapack.dpotri(factor, lower=1, overwrite_c=1)
    lower = np.tril(inverted)
    return lower + np.tril(lower, -1).T, log_determinant


def radial_gradient(weights, width, x):
    """Gradient by the inputs and by the log width, given the derivative of the loss by the kernel, times the kernel."""
    gradient = -2 * width * (weights.sum(1)[:, None] * x - weights @ x)
    return gradient, 0.5 * (x * gradient).sum()


def value_and_gradient(theta, scaled, scales):
    """First order, no steps, one sequence, plain GPDM (balance 1)."""
    frames = scaled.shape[0]
    latents = theta[:-6].reshape(LATENTS, frames).T
    width, precision, amplitude, dynamics_width, linear, dynamics_precision = np.exp(theta[-6:])
    radial = np.exp(-0.5 * width * squared_distances(latents, latents))
    covariance = radial.copy()
    covariance[np.diag_indices(frames)] += 1 / precision
    inverted, log_determinant = inverse(covariance)
    solution = inverted @ scaled
    value = 0.5 * DIMENSIONS * log_determinant + 0.5 * (scaled * solution).sum()
    by_kernel = 0.5 * (DIMENSIONS * inverted - solution @ solution.T)
    gradient, by_width = radial_gradient(by_kernel * radial, width, latents)
    by_precision = -np.trace(by_kernel) / precision

    inputs, targets = latents[:-1], latents[1:]
    radial = amplitude * np.exp(-0.5 * dynamics_width * squared_distances(inputs, inputs))
    covariance = radial + linear * (inputs @ inputs.T)
    covariance[np.diag_indices(frames - 1)] += 1 / dynamics_precision
    inverted, log_determinant = inverse(covariance)
    solution = inverted @ targets
    value += 0.5 * LATENTS * log_determinant + 0.5 * (targets * solution).sum()
    by_kernel = 0.5 * (LATENTS * inverted - solution @ solution.T)
    weights = by_kernel * radial
    by_inputs, by_dynamics_width = radial_gradient(weights, dynamics_width, inputs)
    product = by_kernel @ inputs
    by_inputs += 2 * linear * product
    gradient[:-1] += by_inputs
    gradient[1:] += solution

    value += 0.5 * (latents[0] ** 2).sum() + theta[-6:].sum()
    gradient[0] += latents[0]
    value += (0.5 * scales**2 / SCALE_PRIOR_VARIANCE - frames * np.log(scales)).sum()
    logarithms = [by_width, by_precision, weights.sum(), by_dynamics_width, linear * (inputs * product).sum()]
    logarithms.append(-np.trace(by_kernel) / dynamics_precision)
    return value, np.concatenate([gradient.T.ravel(), np.array(logarithms) + 1])


class Model:
    """Precomputed quantities for fast prediction."""

    def __init__(self, latents, observations, width, precision):
        self.latents, self.width, self.mean = latents, width, observations.mean(0)
        covariance = np.exp(-0.5 * width * squared_distances(latents, latents))
        covariance[np.diag_indices(len(latents))] += 1 / precision
        self.factor = cho_factor(covariance, lower=True)[0]
        self.weights = np.linalg.solve(covariance, observations - self.mean)

    def moments(self, points):
        """Means (one row per point) and variances of a dimension of unit scale."""
        cross = np.exp(-0.5 * self.width * squared_distances(self.latents, points))
        white = solve_triangular(self.factor, cross, lower=True, check_finite=False)
        return self.mean + cross.T @ self.weights, np.maximum(1 - np.einsum("ij,ij->j", white, white), 0)


def check(frames=20, step=1e-5):
    """Maximum relative error of the gradient against fourth-order central differences."""
    theta, scaled, scales = start(frames), motion(frames), np.ones(DIMENSIONS)
    gradient = value_and_gradient(theta, scaled, scales)[1]
    worst = 0.0
    for k in range(len(theta)):
        at = lambda h: value_and_gradient(theta + h * (np.arange(len(theta)) == k), scaled, scales)[0]
        numeric = (8 * (at(step) - at(-step)) - (at(2 * step) - at(-2 * step))) / (12 * step)
        worst = max(worst, abs(numeric - gradient[k]) / max(abs(gradient[k]), 1e-3 * abs(gradient).max()))
    return worst


def fastest(work, seconds):
    """Milliseconds of the fastest sample."""
    end, least = time.perf_counter() + seconds, float("inf")
    while time.perf_counter() < end:
        begun = time.perf_counter()
        work()
        least = min(least, time.perf_counter() - begun)
    return 1e3 * least


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=8.0, help="time spent on each figure")
    seconds = parser.parse_args().seconds
    worst = check()
    print(f"gradient against central differences: {worst:.1e}")
    assert worst < 1e-6
    for frames in (60, 150, 480):
        theta, observations, scales = start(frames), motion(frames), np.ones(DIMENSIONS)
        value, gradient = value_and_gradient(theta, observations, scales)
        least = fastest(lambda: value_and_gradient(theta, observations, scales), seconds)
        print(f"N = {frames}: loss {value:.9f}, |gradient| {np.linalg.norm(gradient):.9f}: {least:.3f} ms")
        model = Model(theta[:-6].reshape(LATENTS, frames).T, observations, 1.0, 50.0)
        i, c = np.arange(PARTICLES)[:, None], np.arange(LATENTS)[None, :]
        points = np.sin(i * (c + 2) * 0.37)
        least = fastest(lambda: model.moments(points), seconds)
        print(f"N = {frames}: {PARTICLES} predictions, mean and variance: {least:.3f} ms")


if __name__ == "__main__":
    main()
