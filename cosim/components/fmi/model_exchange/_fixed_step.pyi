from typing import Final

#: address of the C function `advance`, whose signature is that of fmi2DoStep
ADVANCE: Final[int]
#: size of its state (bytes)
STATE_SIZE: Final[int]
