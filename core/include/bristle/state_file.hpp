// The state of a batch in a file. For set-up and saving, not for a servo thread: these calls allocate, wait
// for the disk and throw.
//
// From a servo thread: keep a buffer of PatchBatch::state_size() bytes, call PatchBatch::save_state there
// (it copies, and neither allocates nor waits), and hand the buffer to a thread that calls write_state_file.
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "bristle/export.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/span.hpp"

namespace bristle {

/// What a state file holds.
struct StateFile {
  std::vector<std::byte> state;  ///< what PatchBatch::save_state wrote
  std::vector<std::byte> extra;  ///< the caller's own: time, positions of bodies, whatever belongs to it
};

/// Writes what PatchBatch::save_state wrote, and bytes of the caller's own beside it. The file is there whole
/// or not at all: written beside `path` under a name of its own, flushed to the disk, and renamed over what
/// was there. A symbolic link is replaced by the file. Throws bristle::Error naming the file when it cannot
/// be written, and when `path` is something else than a file; what was there then stays. One error
/// comes after the renaming, and says so: the file was written, its folder could not be flushed to the disk.
BRISTLE_API void write_state_file(const std::string& path, Span<const std::byte> state,
                                  Span<const std::byte> extra = {});

/// Reads a state file and checks it: one that is no state file, cut short, longer than it says, damaged or of
/// another format version is refused. A file of more than `most_bytes` is refused before memory is taken for
/// it. Throws bristle::Error naming the file.
BRISTLE_API StateFile read_state_file(const std::string& path,
                                      std::size_t most_bytes = std::numeric_limits<std::size_t>::max());

/// PatchBatch::save_state into a file. On the stepping thread, or while it rests. Throws as write_state_file.
BRISTLE_API void save_state_file(const std::string& path, const PatchBatch& batch,
                                 Span<const std::byte> extra = {});

/// PatchBatch::restore_state from a file, into a batch with the same patches. Returns the caller's own bytes.
/// On the stepping thread, or while it rests. Throws bristle::Error naming the file; the batch is then as it
/// was. A file with more than the state of such a batch and `most_extra_bytes` beside it is refused before
/// memory is taken for it.
BRISTLE_API std::vector<std::byte> restore_state_file(const std::string& path, PatchBatch& batch,
                                                      std::size_t most_extra_bytes = std::size_t{1} << 20);

}  // namespace bristle
