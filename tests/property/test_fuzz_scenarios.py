"""Scenarios drawn from all that fields allow: each is refused in a sentence, or its episode goes well."""

from benchmarks.fuzz import drawn_fields, escaped
from wifipgo.scenarios import field_owners


def test_no_scenario_escapes() -> None:
    """No exception but a refusal, no nan, no observation outside its space, every info finite."""
    assert [fault for seed in range(40) for fault in escaped(seed, n_steps=3)] == []


def test_every_field_is_drawn() -> None:
    """A new field is fuzzed without being told."""
    drawn = {name for seed in range(200) for name in drawn_fields(seed)}
    assert drawn == set(field_owners()) - {"name", "source"}
