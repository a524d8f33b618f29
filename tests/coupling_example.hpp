// Displacement after a second of the plate of coupling_example.cpp, m.
#pragma once

double pushed_plate(double push);
