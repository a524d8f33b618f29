// The state of a batch in a file. These calls are for set-up and saving, not for a servo thread: they
// allocate, wait for the disk and throw.
//
// On a servo thread, keep a buffer of PatchBatch::state_size() bytes, call PatchBatch::save_state (it copies,
// and does not allocate or wait), and pass the buffer to a thread that calls write_state_file.
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "bristle/export.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/span.hpp"

namespace bristle {

/// The contents of a state file.
struct StateFile {
  std::vector<std::byte> state;  ///< output of PatchBatch::save_state
  std::vector<std::byte> extra;  ///< bytes of the caller's own: time, positions of bodies and the like
};

/// Writes the output of PatchBatch::save_state, and bytes of the caller. The file is written completely or
/// not at all: it is written next to `path` under a temporary name, flushed to disk, and renamed to `path`,
/// replacing an earlier file. A symbolic link is replaced by the file. Throws bristle::Error naming the file
/// if it cannot be written or if `path` is not a file; whatever was there then stays. One error can occur
/// after the renaming, and says so: the file was written, but its folder could not be flushed to disk.
BRISTLE_API void write_state_file(const std::string& path, Span<const std::byte> state,
                                  Span<const std::byte> extra = {});

/// Reads a state file and checks it. A file that is not a state file, is truncated, is longer than its header
/// says, is damaged or has another format version is refused. A file of more than `most_bytes` is refused
/// before memory is allocated for it. Throws bristle::Error naming the file.
BRISTLE_API StateFile read_state_file(const std::string& path,
                                      std::size_t most_bytes = std::numeric_limits<std::size_t>::max());

/// Writes PatchBatch::save_state into a file. Call it on the stepping thread, or while no thread steps.
/// Throws as write_state_file.
BRISTLE_API void save_state_file(const std::string& path, const PatchBatch& batch,
                                 Span<const std::byte> extra = {});

/// Restores a file by PatchBatch::restore_state, into a batch with the same patches. Returns the bytes of the
/// caller. Call it on the stepping thread, or while no thread steps. Throws bristle::Error naming the file;
/// the batch then stays as it was. A file that exceeds the state of such a batch and `most_extra_bytes` of
/// the caller is refused before memory is allocated for it.
BRISTLE_API std::vector<std::byte> restore_state_file(const std::string& path, PatchBatch& batch,
                                                      std::size_t most_extra_bytes = std::size_t{1} << 20);

}  // namespace bristle
