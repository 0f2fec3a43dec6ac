"""The diagnosis of the measured actuator picma_p885, where its record is at hand."""

import json
from pathlib import Path

import pandas as pd
import pytest
from diagnose_cases import run
from test_measured import PICMA, needs_picma

PARTS = {"identify": (1.0, 10.0), "train/middle": (10.0, 25.0), "holdout/end": (25.0, 40.0)}


@needs_picma
def test_picma_split_in_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case = tmp_path / "case"
    frame = pd.read_csv(PICMA)
    for name, (start, end) in PARTS.items():
        path = case / f"{name}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        frame[(frame["t_s"] >= start) & (frame["t_s"] < end)].to_csv(path, index=False)
    device = {"device": "PICMA P-885.91", "u_min_V": 0.0, "u_max_V": 3.6, "y_unit": "um"}
    running = {"running": [Path(name).name for name in PARTS]}
    (case / "case.json").write_text(json.dumps(device | running))
    found = run(monkeypatch, case, tmp_path / "out")
    gap, verdict, shrink = (found[k] for k in ("gap", "verdict", "shrink"))
    print(f"\n{verdict['status']}: {verdict['effects']}, candidates {verdict['candidates']}")
    print(f"remainder {verdict['remainder_share']:.3f}, gap {gap}")
    print(f"hold-out {shrink['rms_before_um']:.3f} -> {shrink['rms_after_um']:.3f} um rms")
    stroke = 100.0 * gap["rms_um"] / gap["percent_of_stroke"]
    assert 20.0 < stroke < 400.0
    assert 0.02 < gap["noise_floor_um"] < 0.2 < gap["rms_um"] < 0.05 * stroke
    assert verdict["status"] in ("identified", "ambiguous", "unknown")
    assert 0.0 < shrink["rms_after_um"] < 1.1 * shrink["rms_before_um"]
    assert found["where"]
    assert found["verdict"]["effects"] == ["asymmetry"], "what the README says"
    assert set(found["verdict"]["candidates"]) == {"delay", "amplifier_lag"}
    made = pd.read_csv(tmp_path / "out" / "holdout" / "end.csv")
    assert len(made) == 3000 and made.notna().all().all()
