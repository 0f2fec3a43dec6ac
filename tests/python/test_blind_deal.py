"""The cases of a trial: they keep the contract, and their labels say what acts."""

import json
from pathlib import Path

import numpy as np
import pytest

from madelung.blind.deal import deal_case
from madelung.blind.excitations import draw_commands
from madelung.blind.laws import LAWS, Draw, draw_law
from madelung.diagnosis.case import load_case
from madelung.sim_effects import EFFECTS, OUTSIDE, VOCABULARY
from madelung.stage import Stage, make_scene

SEEDS = range(40)


def test_every_campaign_keeps_the_contract() -> None:
    slow, rates, bottoms = 0, set(), set()
    for seed in SEEDS:
        every = draw_commands(np.random.default_rng(seed), -20.0, 130.0)
        train = [c for k, c in every.items() if k.startswith("train/")]
        identify = every["identify"]
        assert identify.hz * identify.seconds >= 2.0
        assert (identify.u_min_V, identify.u_max_V) == (-20.0, 130.0)
        assert train and any(k.startswith("holdout/") for k in every)
        assert all(2000 <= c.samples <= 110_000 for c in every.values())
        assert any(c.at([0.0])[0] > -20.0 + 0.25 * 150.0 for c in train)
        slow += all(np.abs(np.diff(c.at(c.time_s))).max() * c.rate_hz < 1500.0 for c in train)
        rates |= {c.rate_hz for c in train}
        bottoms |= {c.u_min_V for c in train}
    assert 1 <= slow <= 20
    assert min(rates) <= 200.0 and max(rates) >= 10_000.0 and len(bottoms) > 20


@pytest.mark.parametrize("effect", list(EFFECTS))
def test_every_law_acts_more_the_stronger_it_is(effect: str) -> None:
    stage = Stage()
    every = draw_commands(np.random.default_rng(5), stage.u_min_V, stage.u_max_V)
    scene = make_scene(stage, every)
    seen = set()
    for seed in range(30):
        strong, weak = (
            draw_law(effect, Draw(np.random.default_rng(seed), strength, scene, 10.0))
            for strength in (1.0, 0.1)
        )
        assert strong[0] == weak[0]
        assert set(strong[1]) <= set(EFFECTS[effect].keys)
        assert strong[1] != weak[1]
        seen.add(strong[0])
    assert seen == set(LAWS.get(effect, {effect: None}))


def test_a_case_is_the_same_for_its_seed_and_its_label_is_plain(tmp_path: Path) -> None:
    one, two = (deal_case(tmp_path / name, 17) for name in ("one", "two"))
    assert json.loads(json.dumps(one)) == two
    for path in (tmp_path / "one").rglob("*.*"):
        assert (
            path.read_bytes()
            == (tmp_path / "two" / path.relative_to(tmp_path / "one")).read_bytes()
        )


def test_a_label_says_what_each_effect_changes(tmp_path: Path) -> None:
    kinds = set()
    for seed in (5, 6, 15):
        folder = tmp_path / str(seed)
        label = deal_case(folder, seed)
        kinds.add(label["kind"])
        load_case(folder)
        acting = [*label["effects"], *label["outside"]]
        assert set(acting) == set(label["size"]) == set(label["law"]) == set(label["rms_um"])
        for name in acting:
            assert label["rms_um"][name]["train"] > 0.0
        told = (folder / "case.json").read_text()
        assert not any(name in told for name in acting)
        assert len({p.stem for p in folder.rglob("*.csv")}) == len(label["records"])
    assert kinds == {"none", "pair", "single"}


def test_an_effect_that_is_left_out_counts_as_outside(tmp_path: Path) -> None:
    label = deal_case(tmp_path / "case", 15, left_out=True)
    assert label["kind"] == "left_out" and label["effects"] == []
    assert set(label["outside"]) <= set(VOCABULARY)
    assert load_case(tmp_path / "case").exclude == frozenset(label["outside"])


def test_laws_and_vocabulary_agree() -> None:
    assert LAWS.keys() == VOCABULARY.keys() and not LAWS.keys() & OUTSIDE.keys()
