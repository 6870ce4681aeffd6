"""A NUCLEO-F446RE with the sensor's circuit around it, as a program. README.md says how it works."""
