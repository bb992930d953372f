"""Shipped sweeps and tunings: each is read and its first run is prepared."""

import json

import pytest

from cosim.core import resources
from cosim.scenario import load
from cosim.studies.sweep import Sweep
from cosim.studies.tune import Tuning

FILES = sorted(resources.root().glob("scenarios/sweeps/*.json"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_shipped_file_can_be_run(file):
    if "minimize" in json.loads(file.read_text()):
        tuning = Tuning.from_file(file.stem)
        study, settings = (
            tuning.study,
            {**tuning.spec.cases[0], **tuning.settings({p.name: p.min for p in tuning.spec.parameters})},
        )
    else:
        sweep = Sweep.from_file(file.stem)
        study, settings = sweep.study, next(iter(sweep.design)).settings
        assert sweep.criteria
    assert str(study.bundle.scenario) in study.bundle.files
    prepared = load(study.study_file.scenario, study.job(settings).settings, settings_folder=study.study_file.scenario.parent)
    assert prepared.kpis()
    prepared.free()


def test_sweeps_are_shipped():
    assert {file.stem for file in FILES} >= {"demo1_landing", "strider_heading_gains"}
