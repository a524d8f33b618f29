// How far the plate of core/MODEL.md's example comes, m.
#pragma once

double pushed_plate(double push);
