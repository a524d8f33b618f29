// The C++ interface of bristle that needs no other library. Not included: coupling.hpp,
// extended_coupling.hpp, contact_frame.hpp and haptic_point.hpp, which need Eigen, and bristle.h, the
// interface for C.
#pragma once

#include "bristle/build_check.hpp"
#include "bristle/config.hpp"
#include "bristle/deadline_monitor.hpp"
#include "bristle/error.hpp"
#include "bristle/export.hpp"
#include "bristle/keyed_patches.hpp"
#include "bristle/material.hpp"
#include "bristle/patch.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/patch_group.hpp"
#include "bristle/snap_length.hpp"
#include "bristle/span.hpp"
#include "bristle/time_histogram.hpp"
#include "bristle/typical_materials.hpp"
#include "bristle/version.hpp"

#if BRISTLE_WITH_BEDS
#include "bristle/bed.hpp"
#include "bristle/keyed_beds.hpp"
#endif
#if BRISTLE_WITH_JOINTS
#include "bristle/joint_friction.hpp"
#endif
#if BRISTLE_WITH_OUTLINES
#include "bristle/extended_patches.hpp"
#include "bristle/outline.hpp"
#endif
