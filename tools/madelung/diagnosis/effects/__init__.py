"""The effects as physical models: parameters in units and bounds, and what they change.

One module for each box of the signal path. A form is one model of one effect; an effect may have
several (hard and soft saturation, one and two modes). A form changes the signal path that the C
core runs, or the measured displacement behind it (what no open-loop firmware can run), or the
history before a record.
"""

from madelung.diagnosis.effects.form import Form, Scales
from madelung.diagnosis.effects.hysteresis import hysteresis_forms
from madelung.diagnosis.effects.input import input_forms
from madelung.diagnosis.effects.mechanics import creep_forms, mechanics_forms
from madelung.diagnosis.effects.sensor import sensor_forms


def forms(s: Scales) -> list[Form]:
    """Every form of every effect for a case, but for lines, whose number the records tell."""
    return [
        *input_forms(s),
        *hysteresis_forms(s),
        *creep_forms(s),
        *mechanics_forms(s),
        *sensor_forms(s),
    ]
