"""The paper's claim in small: active rendezvous keeps the error below that of random rendezvous."""

from pathlib import Path

from baselines.evaluate import EvaluateConfig, evaluate


def test_random_rendezvous_ends_with_more_error(tmp_path: Path) -> None:
    """Eight pairs: the intervals of the ratio of Err and of the difference of ATE are on one side."""
    config = EvaluateConfig(scenario="paper-hw-2", trials=8, jobs=1, out=tmp_path / "out")
    random = evaluate(config).paired["random"]
    assert random.n_pairs == 8
    assert random.err_ratio.low is not None
    assert random.err_ratio.low > 1.0
    assert random.ate_trans_difference.low is not None
    assert random.ate_trans_difference.low > 0.0
