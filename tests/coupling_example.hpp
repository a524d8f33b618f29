// Stopping distance of the plate of core/MODEL.md's example, m.
#pragma once

double pushed_plate(double push);
