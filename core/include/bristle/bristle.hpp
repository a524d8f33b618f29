// All of bristle's C++ interface.
#pragma once

#include "bristle/deadline_monitor.hpp"
#include "bristle/error.hpp"
#include "bristle/keyed_patches.hpp"
#include "bristle/material.hpp"
#include "bristle/patch.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/snap_length.hpp"
#include "bristle/span.hpp"
#include "bristle/version.hpp"
