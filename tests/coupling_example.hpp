// Returns the displacement, m, of the plate of coupling_example.cpp after a second under the force `push`, N.
#pragma once

double pushed_plate(double push);
