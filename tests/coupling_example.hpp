// Displacement, m, of the plate of coupling_example.cpp after a second.
#pragma once

double pushed_plate(double push);
