"""Parameters of commercial sensors in SI units, each with its source.

- [BMI088] Bosch Sensortec BMI088, data sheet BST-BMI088-DS001
- [ADIS] Analog Devices ADIS16448 as in the RotorS simulator (Furrer et al., "RotorS - A modular
  Gazebo MAV simulator framework", 2016; gazebo_imu_plugin.h), which doubles the densities of the
  data sheet
- [F9P] u-blox ZED-F9P, data sheet UBX-17051259, RTK fixed, short base line
- [M8N] u-blox NEO-M8N, data sheet UBX-15031086
- [typical] common value, not in a data sheet

Sensors with a single set of parameters name their sources in the docstring of the class.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

_DEGREE, _MILLI_G, _HOUR = math.radians(1.0), 9.81e-3, 3600.0

Numbers = Mapping[str, float]

#: noise_density (unit/sqrt(Hz)), bias_walk (unit/s/sqrt(Hz)), correlation_time (s), turn_on_bias
#: and range (unit); rad/s and m/s2
IMU_DEVICES: Mapping[str, Mapping[str, Numbers]] = {
    "bmi088": {
        "gyroscope": {
            "noise_density": 0.014 * _DEGREE,  # [BMI088]
            # sigma sqrt(2 / correlation_time) of a Gauss-Markov process with the bias stability of
            # 2 deg/h [BMI088]
            "bias_walk": 2.0 * _DEGREE / _HOUR * math.sqrt(2 / 1000.0),
            "correlation_time": 1000.0,  # [ADIS]
            "turn_on_bias": 1.0 * _DEGREE,  # zero-rate offset [BMI088]
            "range": 2000.0 * _DEGREE,  # [BMI088]
        },
        "accelerometer": {
            "noise_density": 0.175 * _MILLI_G,  # [BMI088]
            "bias_walk": 0.02 * _MILLI_G * math.sqrt(2 / 300.0),  # of 0.02 mg [typical]
            "correlation_time": 300.0,  # [ADIS]
            "turn_on_bias": 20.0 * _MILLI_G,  # zero-g offset [BMI088]
            "range": 24.0e3 * _MILLI_G,  # [BMI088]
        },
    },
    "adis16448": {
        "gyroscope": {
            "noise_density": 2 * 35.0 / _HOUR * _DEGREE,
            "bias_walk": 2 * 4.0 / _HOUR * _DEGREE,
            "correlation_time": 1000.0,
            "turn_on_bias": 0.5 * _DEGREE,
            "range": 1000.0 * _DEGREE,
        },
        "accelerometer": {
            "noise_density": 2 * 2.0e-3,
            "bias_walk": 2 * 3.0e-3,
            "correlation_time": 300.0,
            "turn_on_bias": 20.0 * _MILLI_G,
            "range": 18.0e3 * _MILLI_G,
        },
    },
}

#: standard deviation along each of two axes per CEP radius: 1 / 1.1774
_CEP = 1 / math.sqrt(2 * math.log(2))

#: white noise and slow error of the position (m), white noise of the velocity (m/s), correlation
#: time (s), rate (Hz), latency (s)
GNSS_RECEIVERS: Mapping[str, Numbers] = {
    "standard": {
        "horizontal_noise": 0.1,  # [typical]
        "vertical_noise": 0.2,  # [typical]
        "horizontal_drift": 2.5 * _CEP,  # [M8N]
        "vertical_drift": 2 * 2.5 * _CEP,  # about twice the horizontal one [typical]
        "velocity_noise": 0.05,  # [M8N]
        "correlation_time": 60.0,  # [typical], as in PX4's simulated receiver
        "rate": 5.0,  # [M8N]
        "latency": 0.1,  # [typical]
    },
    "rtk": {
        "horizontal_noise": 0.01
        * _CEP
        / math.sqrt(2),  # half of the variance each in noise and drift
        "vertical_noise": 0.01
        * 1.4826
        / math.sqrt(2),  # 0.01 m is the median of the absolute error [F9P]
        "horizontal_drift": 0.01 * _CEP / math.sqrt(2),  # [F9P]
        "vertical_drift": 0.01 * 1.4826 / math.sqrt(2),
        "velocity_noise": 0.05,  # [F9P]
        "correlation_time": 60.0,
        "rate": 10.0,  # [F9P]
        "latency": 0.05,  # [typical]
    },
}
