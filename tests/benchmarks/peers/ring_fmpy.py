"""FMPy: the methods of FMU2Slave in a hand-written loop."""

import shutil

import fmpy
from driver import STEP, Clock, Outcome, Ring, main
from fmpy.fmi2 import FMU2Slave


def run(ring: Ring) -> Outcome:
    folder = fmpy.extract(ring.fmu)
    description = fmpy.read_model_description(folder)
    reference = {
        variable.name: [variable.valueReference] for variable in description.modelVariables
    }
    instances = [_initialize_fmu(description, folder, name) for name in ring.names]
    record = []
    with Clock() as clock:
        for k in range(ring.steps):
            outputs = [fmu.getReal(reference["y1"])[0] for fmu in instances]
            for i, fmu in enumerate(instances):
                fmu.setReal(reference["u1"], [outputs[i - 1]])
            for fmu in instances:
                fmu.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
            record.append(outputs[0])
    for fmu in instances:
        fmu.terminate()
        fmu.freeInstance()
    shutil.rmtree(folder, ignore_errors=True)
    return clock.cpu, clock.wall, record[-1]


def _initialize_fmu(description, folder, name):
    identifier = description.coSimulation.modelIdentifier
    fmu = FMU2Slave(
        guid=description.guid, modelIdentifier=identifier, unzipDirectory=folder, instanceName=name
    )
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    return fmu


if __name__ == "__main__":
    main(run)
