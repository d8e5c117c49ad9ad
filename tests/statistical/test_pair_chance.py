"""Chance of pairs in large teams: as random as drawn numbers, and the pair's own whoever sees whom."""

import numpy as np
import pytest
from scipy import stats

from wifipgo.rows import Generators
from wifipgo.world.pair_chance import pair_normals, pair_uniforms
from wifipgo.world.sensing import SensingConfig, observe_robots

N = 150  # beyond this many robots are hashed


def test_first_numbers_are_those_of_the_generator_as_published() -> None:
    """SplitMix64 from seed 1234567, as in Rosetta Code and in java.util.SplittableRandom."""
    published = [6457827717110365317, 3203168211198807973, 9817491932198370423]

    class Keyed(np.random.Generator):
        def integers(self, *args: object, **named: object) -> np.ndarray:  # type: ignore[override]
            """The seed."""
            return np.array([1234567])

    rng, first = Keyed(np.random.PCG64(0)), np.zeros(1, dtype=np.int64)
    found = pair_uniforms(rng, (N, N), first, first, 3)[0]
    np.testing.assert_allclose(found, np.array(published) / 2.0**64, rtol=1e-14)


def test_numbers_are_normal_and_unrelated() -> None:
    """Over pairs, components and steps: law, moments and correlations."""
    rng = np.random.default_rng(0)
    row, peer = np.divmod(np.arange(N * N), N)
    drawn = np.stack([pair_normals(rng, (N, N), row, peer, 3) for _ in range(8)])
    assert stats.kstest(drawn.ravel(), "norm").pvalue > 1e-3
    assert abs(drawn.var() - 1.0) < 0.01
    assert abs((drawn**4).mean() - 3.0) < 0.05
    table, few = drawn.reshape(8, N, N, 3), 5.0 / np.sqrt(drawn.size / 8)
    for a, b in [
        (table[1:], table[:-1]),
        (table[:, 1:], table[:, :-1]),
        (table[:, :, 1:], table[:, :, :-1]),
        (table[..., 1:], table[..., :-1]),
        (table, table.swapaxes(1, 2) * (1.0 - np.eye(N))[..., None]),
    ]:
        assert abs((a * b).mean()) < few


@pytest.mark.parametrize("n", [40, N])
def test_noise_of_a_pair_does_not_depend_on_who_else_is_seen(n: int) -> None:
    """Nor on the other worlds of a batch; and the streams stand where they stand for anybody."""
    rng = np.random.default_rng(1)
    poses, cfg = rng.normal(size=(2 * n, 3)), SensingConfig(outlier_share=0.5)
    seen = rng.random((2 * n, n)) < 0.1
    some = seen & (rng.random(seen.shape) < 0.5)

    def streams(seed: int) -> tuple[Generators, Generators]:
        each = [[np.random.default_rng([seed, world]) for world in range(2)] for seed in (seed, seed + 1)]
        return Generators(each[0]), Generators(each[1])

    found, went_on = [], []
    for table in (seen, some):
        noise, outliers = streams(5)
        found.append(observe_robots(poses, 3, table, cfg=cfg, rng=noise, outlier_rng=outliers))
        went_on.append((noise.standard_normal((2, 1)), outliers.random((2, 1))))
    np.testing.assert_array_equal(went_on[0], went_on[1])
    kept = some[seen]
    for a, b in zip(*found, strict=True):
        np.testing.assert_array_equal(a[kept], b)
    alone = observe_robots(
        poses[n:],
        3,
        seen[n:],
        cfg=cfg,
        rng=np.random.default_rng([5, 1]),
        outlier_rng=np.random.default_rng([6, 1]),
    )
    np.testing.assert_array_equal(alone.z, found[0].z[found[0].tail[:, 0] >= n])
    assert 0.4 < found[0].is_outlier.mean() < 0.6
