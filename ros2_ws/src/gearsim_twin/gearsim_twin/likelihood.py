"""How well predicted levels explain measured ones, with what is not known of either integrated out.

Of a difference r between measured and predicted level, variance s^2 = sampling of both sides + tau^2,
where tau is what a good model still misses in that domain, the density is that of a mixture

    (1 - pi) t_5(r / s) / s + pi N(r; 0, s^2 + W^2)

The t distribution forgives single places. The wide part is the rival named *unknown*: a free-form model
that explains any difference anywhere, at the price of log(1 / pi) and of a density spread over W. A cause
must explain differences more cheaply than that, and halving a large difference earns it next to nothing.
tau and pi are found per domain for each model, so a model that explains a domain may claim to be sharper.
Of a level that records of the healthy machine had already only a share w rests on the model (`familiar`);
there tau^2 becomes (w tau)^2 + (rho s)^2, with s what runs of one machine differ by, and rho found likewise.

What is assumed of the measuring chain is normal: a gain that is off by 17 standard deviations is no outlier
but a cause of its own.

Log likelihoods are multiplied by the share of differences that are independent (see `dependence`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.sparse import csr_array
from scipy.special import gammaln

from gearsim_twin.dependence import independent_share
from gearsim_twin.stack import ASSUMED, TONES, Array, Levels, Stack

__all__ = ["REPEAT_FACTOR", "TAU_FACTOR", "Noise", "Posterior", "Yardstick"]

_NU = 5.0
_T_CONST = float(gammaln((_NU + 1) / 2) - gammaln(_NU / 2) - 0.5 * np.log(_NU * np.pi))
# What an unknown effect does to a level: from nothing to some 40 dB.
WIDE_DB = 20.0
# What is wholly absent is as wrong as it can be.
MOST_DB = 40.0
# Of all places those that anything may explain: were it many, no cause could explain a few lines better.
_OUTLYING = np.array([0.003, 0.01, 0.03])
# Within which the scatter of levels at single places about a good model is known beforehand.
TAU_FACTOR = 1.6
REPEAT_FACTOR = 1.6
"""The same of what runs of one machine differ by, where a single record of it healthy is at hand."""
# Share above which a level rests on the model.
_RULED = 0.5
# A rig of few masses is wrong by many decibels everywhere: what tuning leaves is what it errs by. Measured
# by less than that no cause would be sure to gain anything.
_TAU_STEPS = np.linspace(-2.5, 5.5, 17)
_TONE_STEPS = 3.0
_ROUNDS, _NOISE_ROUNDS, _SAME = 10, 4, 1e-2


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """Per domain: spread of the model's own errors, share of outlying places, and log likelihood.

    `repeat` is the factor on what runs of one machine differ by; `quiet` the log likelihood of all places
    where neither side has anything.
    """

    tau_db: Array
    outlying: Array
    loglike: Array
    quiet: float
    repeat: Array


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """What is known of p coordinates after the measurement, by the Laplace approximation.

    Attributes
    ----------
    coordinates : ndarray, shape (p,)
        In standard deviations of their priors.
    covariance : ndarray, shape (p, p)
    residual_db : ndarray, shape (n,)
        What is left at those coordinates.
    noise : Noise
    value : float
        Log likelihood plus log priors there, in nats.
    volume : float
        Log of the posterior's volume over that of the prior, smooth errors included: with it, `value` becomes
        the evidence.
    """

    coordinates: Array
    covariance: Array
    residual_db: Array
    noise: Noise
    value: float
    volume: float


@dataclass(frozen=True, slots=True, eq=False)
class Yardstick:
    """The measure of all models of one comparison.

    Parameters
    ----------
    stack : Stack
    share : ndarray, shape (domains,)
        Independent differences per place.
    tau_median_db, tau_factor : ndarray, shape (domains,)
        What is known of tau beforehand.
    use : ndarray of bool, shape (n,)
        Places that count.
    smooth : csr_array, shape (n, q)
        Smooth errors (see `systematic`), each with a standard normal coordinate.
    repeat_factor : ndarray, shape (domains,), optional
        Within which it is known beforehand what runs of one machine differ by.
    """

    stack: Stack
    share: Array
    tau_median_db: Array
    tau_factor: Array
    use: np.ndarray
    smooth: csr_array
    repeat_factor: Array = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if self.repeat_factor.size != len(self.stack.domains):
            object.__setattr__(self, "repeat_factor", np.full(len(self.stack.domains), REPEAT_FACTOR))

    def noise(self, residual_db: Array, predicted: Levels) -> Noise:
        """The most probable tau, share of outlying places, and factor on repeatability in each domain."""
        count = len(self.stack.domains)
        tau, outlying, best = np.zeros(count), np.zeros(count), np.zeros(count)
        repeat = np.ones(count)
        told = np.isfinite(residual_db)
        variance, own = self.variance(predicted), predicted.own
        for d, name in enumerate(self.stack.domains):
            mine = told & (self.stack.domain == d)
            if name == ASSUMED:
                best[d] = float(_gauss(residual_db[mine], variance[mine]).sum())
                continue
            # Tones are no model's: what stands out among few of them is not what models err by.
            steps = _TAU_STEPS[_TAU_STEPS <= _TONE_STEPS] if name == TONES else _TAU_STEPS
            grid = self.tau_median_db[d] * self.tau_factor[d] ** steps
            factors = self.repeat_factor[d] ** steps
            # tau is told by places that rest on the model, repeatability by those that were there before.
            ruled = mine & (own >= _RULED)
            before = mine & (own < _RULED)
            missed2 = (grid[:, None] * own[ruled]) ** 2 + predicted.repeat_db[ruled] ** 2
            value = self._over(d, residual_db[ruled], variance[ruled] + missed2) - 0.5 * steps[:, None] ** 2
            missed2 = (self.tau_median_db[d] * own[before]) ** 2
            missed2 = missed2 + (factors[:, None] * predicted.repeat_db[before]) ** 2
            other = self._over(d, residual_db[before], variance[before] + missed2) - 0.5 * steps[:, None] ** 2
            m = int(np.argmax(value.max(axis=0) + other.max(axis=0)))
            k, j = int(np.argmax(value[:, m])), int(np.argmax(other[:, m]))
            tau[d], outlying[d], repeat[d] = grid[k], _OUTLYING[m], factors[j]
            best[d] = value[k, m] + other[j, m]
        return Noise(tau, outlying, best, float(self._quiet(told, predicted).sum()), repeat)

    def _over(self, domain: int, residual_db: Array, s2: Array) -> Array:
        """Log likelihoods of some places for variances s2 (steps, places), shape (steps, shares outlying)."""
        core, wide = densities(residual_db, s2)
        terms = np.log(core[:, None] + _OUTLYING[:, None] * (wide - core)[:, None])
        return np.asarray(self.share[domain] * terms.sum(axis=-1))

    def missed(self, predicted: Levels, noise: Noise) -> Array:
        """Variance of what is wrong of a prediction beside sampling, dB^2, shape (n,)."""
        domain = self.stack.domain
        repeat = noise.repeat[domain] * predicted.repeat_db
        return np.asarray((noise.tau_db[domain] * predicted.own) ** 2 + repeat**2)

    def loglike(self, residual_db: Array, predicted: Levels, noise: Noise) -> Array:
        """Log likelihood of each place, times its share, shape (n,); 0 where a place does not count."""
        told = np.isfinite(residual_db)
        variance = self.variance(predicted)
        # Where one side has nothing its variance may be infinite, too.
        s2 = np.where(told, variance, 1.0) + self.missed(predicted, noise)
        core, wide = densities(np.where(told, residual_db, 0.0), s2)
        outlying = noise.outlying[self.stack.domain]
        mixed = np.log(core + outlying * (wide - core)) * self.share[self.stack.domain]
        terms = np.where(self.is_assumed, _gauss(np.where(told, residual_db, 0.0), variance), mixed)
        return np.where(told, terms, self._quiet(told, predicted))

    @property
    def is_assumed(self) -> np.ndarray:
        """Which places are assumptions."""
        return np.asarray(np.array(self.stack.domains)[self.stack.domain] == ASSUMED)

    def _quiet(self, told: np.ndarray, predicted: Levels) -> Array:
        """Log likelihood of places where neither side has anything: they agree, whatever tau is."""
        domain = self.stack.domain
        missed2 = (self.tau_median_db[domain] * predicted.own) ** 2 + predicted.repeat_db**2
        s2 = np.where(self.use, self.stack.measured.std_db, 1.0) ** 2 + missed2
        return np.asarray(np.where(self.use & ~told, (_T_CONST - 0.5 * np.log(s2)) * self.share[domain], 0.0))

    def value(self, predicted: Levels, coordinates: Array) -> float:
        """Log likelihood of a prediction with the best smooth errors, and log priors, in nats."""
        own = np.zeros((self.stack.size, 0))
        found = self.posterior(predicted, own, np.zeros(0))
        return found.value - 0.5 * float(coordinates @ coordinates)

    def adapted(
        self, predicted: Levels, slopes: Array, coordinates: Array, noise: Noise
    ) -> tuple[Levels, Array]:
        """One step of the coordinates towards the measured levels, levels being linear in them."""
        start = self.residual(predicted)
        weight, _ = self._weights(start, predicted, noise)
        smooth = self._smooth(predicted)
        shift = _shift(weight, slopes, smooth, np.nan_to_num(start), coordinates)
        own = shift[: coordinates.size]
        return replace(predicted, level_db=predicted.level_db + slopes @ own), coordinates + own

    def residual(self, predicted: Levels) -> Array:
        """Measured minus predicted, dB, shape (n,); NaN where nothing is to be compared."""
        told = self.use & (self.stack.measured.clear | predicted.clear)
        difference = np.where(told, self.stack.measured.level_db, 0.0) - predicted.level_db
        return np.where(told, np.clip(difference, -MOST_DB, MOST_DB), np.nan)

    def variance(self, predicted: Levels) -> Array:
        """Sampling variance of both sides, dB^2, shape (n,)."""
        measured = np.where(self.use, self.stack.measured.std_db, 1.0)
        return np.asarray(measured**2 + predicted.std_db**2)

    def z(self, residual_db: Array, predicted: Levels, noise: Noise) -> Array:
        """Differences in standard deviations, shape (n,); 0 where there is none."""
        spread = np.sqrt(self.variance(predicted) + self.missed(predicted, noise))
        return np.asarray(np.nan_to_num(residual_db) / spread)

    def by_independence(self, residual_db: Array, predicted: Levels, noise: Noise) -> Yardstick:
        """The same with shares of independent differences as some residual shows them."""
        model2 = self.missed(predicted, noise)
        part2 = model2 / np.maximum(model2 + self.variance(predicted), 1e-12)
        count = len(self.stack.domains)
        total = np.bincount(self.stack.domain[self.use], weights=part2[self.use], minlength=count)
        systematic = total / np.maximum(np.bincount(self.stack.domain[self.use], minlength=count), 1)
        z = self.z(residual_db, predicted, noise)
        return replace(self, share=independent_share(self.stack, z, systematic))

    def posterior(self, predicted: Levels, slopes: Array, coordinates: Array) -> Posterior:
        """Coordinates that explain the measured levels best, levels being linear in them.

        Parameters
        ----------
        predicted : Levels
            At `coordinates`.
        slopes : ndarray, shape (n, p)
            Change of the levels per unit of each coordinate, dB.
        coordinates : ndarray, shape (p,)
            Where `predicted` is; each is standard normal beforehand.
        """
        smooth = self._smooth(predicted)
        start = residual = self.residual(predicted)
        noise = self.noise(start, predicted)
        count, last = coordinates.size, np.full(coordinates.size + self.smooth.shape[1], np.inf)
        for turn in range(_ROUNDS):
            noise = self.noise(residual, predicted) if 0 < turn < _NOISE_ROUNDS else noise
            weight, _ = self._weights(residual, predicted, noise)
            shift = _shift(weight, slopes, smooth, np.nan_to_num(start), coordinates)
            residual = start - slopes @ shift[:count] - smooth @ shift[count:]
            if np.max(np.abs(shift - last), initial=0.0) < _SAME:
                break
            last = shift
        noise = self.noise(residual, predicted)
        _, information = self._weights(residual, predicted, noise)
        normal = _normal(information, slopes, smooth)
        everything = shift + np.concatenate([coordinates, np.zeros(shift.size - count)])
        value = float(noise.loglike.sum()) + noise.quiet - 0.5 * float(everything @ everything)
        return Posterior(
            coordinates=everything[:count],
            covariance=np.asarray(np.linalg.inv(normal), dtype=np.float64)[:count, :count],
            residual_db=residual,
            noise=noise,
            value=value,
            volume=-0.5 * float(np.linalg.slogdet(normal)[1]),
        )

    def _smooth(self, predicted: Levels) -> csr_array:
        """Smooth errors of a prediction: those of the model, as far as a level rests on it."""
        if np.all(predicted.own == 1.0):
            return self.smooth
        return csr_array(self.smooth.multiply(predicted.own[:, None]))

    def _weights(self, residual_db: Array, predicted: Levels, noise: Noise) -> tuple[Array, Array]:
        """Weights of least squares that find the maximum, and the information that a place has on its mean.

        The information is that of an M-estimator, (mean of psi')^2 / mean of psi^2 over each domain
        (Huber, Robust Statistics, 1981, 3.2), so that it holds however the differences are distributed.
        """
        domain, told = self.stack.domain, np.isfinite(residual_db)
        s2 = self.variance(predicted) + self.missed(predicted, noise)
        z2 = np.nan_to_num(residual_db) ** 2 / s2
        share = np.where(told, self.share[domain], 0.0)
        weight = share * (_NU + 1.0) / (_NU + z2) / s2
        psi2 = z2 * ((_NU + 1.0) / (_NU + z2)) ** 2
        bend = (_NU + 1.0) * (_NU - z2) / (_NU + z2) ** 2
        efficiency = np.zeros(len(self.stack.domains))
        for d in range(efficiency.size):
            mine = told & (domain == d)
            if np.any(mine):
                spread = max(float(np.mean(psi2[mine])), 0.1)
                efficiency[d] = max(float(np.mean(bend[mine])), 0.05) ** 2 / spread
        plain = np.where(told, 1.0 / s2, 0.0)
        assumed = self.is_assumed
        return np.where(assumed, plain, weight), np.where(assumed, plain, share * efficiency[domain] / s2)


def _normal(weight: Array, slopes: Array, smooth: csr_array) -> Array:
    """Matrix of the normal equations of coordinates and smooth errors, with their priors."""
    count = slopes.shape[1]
    normal = np.eye(count + smooth.shape[1])
    weighted = smooth.multiply(weight[:, None]).tocsr()
    cross = weighted.T @ slopes
    normal[:count, :count] += slopes.T @ (weight[:, None] * slopes)
    normal[count:, :count] += cross
    normal[:count, count:] += cross.T
    normal[count:, count:] += (weighted.T @ smooth).toarray()
    return normal


def _shift(weight: Array, slopes: Array, smooth: csr_array, start: Array, coordinates: Array) -> Array:
    """Step of coordinates and smooth errors that explains `start` best."""
    pull = weight * start
    side = np.concatenate([slopes.T @ pull - coordinates, smooth.T @ pull])
    return np.asarray(np.linalg.solve(_normal(weight, slopes, smooth), side))


def _gauss(residual_db: Array, s2: Array) -> Array:
    """Log density of what is assumed: no share of it is given up as unknown."""
    return np.asarray(-0.5 * np.log(2.0 * np.pi * s2) - 0.5 * residual_db**2 / s2)


def densities(residual_db: Array, s2: Array) -> tuple[Array, Array]:
    """Densities of differences in the core of variance `s2`, and in the wide part, 1/dB."""
    core = np.exp(_T_CONST) / np.sqrt(s2) * (1.0 + residual_db**2 / (_NU * s2)) ** (-0.5 * (_NU + 1.0))
    wide2 = s2 + WIDE_DB**2
    wide = np.exp(-0.5 * residual_db**2 / wide2) / np.sqrt(2.0 * np.pi * wide2)
    return np.asarray(core), np.asarray(wide)
