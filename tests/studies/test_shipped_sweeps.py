"""Shipped sweeps and tunings: each is read and its first run is prepared."""

import json

import pytest

from cosim.core import resources
from cosim.scenario import load
from cosim.studies.optimization import parameter_settings, parameter_values
from cosim.studies.sweep import Sweep
from cosim.studies.tune import Tuning
from cosim.studies.worst_case import WorstCase

FILES = sorted(resources.root().glob("scenarios/sweeps/*.json"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_shipped_file_can_be_run(file):
    content = json.loads(file.read_text())
    if "minimize" in content:
        tuning = Tuning.from_file(file.stem)
        study, settings = (
            tuning.study,
            {
                **tuning.spec.cases[0],
                **tuning.settings({p.name: p.min for p in tuning.spec.parameters}),
            },
        )
    elif "parameters" in content:
        search = WorstCase.from_file(file.stem)
        assert search.criteria
        parameters = search.spec.parameters
        values = parameter_values(parameters, [0.0] * len(parameters))
        study, settings = search.study, parameter_settings(parameters, values)
    else:
        sweep = Sweep.from_file(file.stem)
        study, settings = sweep.study, next(iter(sweep.design)).settings
        assert sweep.criteria
    assert str(study.bundle.scenario) in study.bundle.files
    prepared = load(
        study.study_file.scenario,
        study.job(settings).settings,
        settings_folder=study.study_file.scenario.parent,
    )
    assert prepared.kpis()
    prepared.free()


def test_sweeps_are_shipped():
    assert {file.stem for file in FILES} >= {"demo1_landing", "strider_heading_gains"}
