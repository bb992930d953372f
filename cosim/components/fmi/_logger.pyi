"""Logger of FMI 1.0 and 2.0, which has a variable number of arguments."""

#: address of the C function
LOGGER: int
#: address of the pointer to the function that receives environment, instance name, status and
#: formatted text
RECEIVER: int
