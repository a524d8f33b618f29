// The head of every saved state: 40 bytes in front, by which foreign, damaged and cut bytes are refused.
// core/patches/SAVED_STATE.md has the format.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "bristle/span.hpp"
#include "core/common/hashing.hpp"

namespace bristle::detail {

/// Kind of object that a saved state belongs to. The numbers stand in saved bytes.
enum class SavedKind : std::uint32_t { patches, keys, points, outlines, beds, joints };

constexpr std::size_t saved_head_size = 40;

/// Adds bytes to a checksum: eight at a time, those that remain one by one.
void add_bytes(Hasher& hasher, Span<const std::byte> bytes) noexcept;

/// Writes the head, with length and checksum, in front of bytes that are already written. `state`: all bytes,
/// head included. `count`: number of patches, beds and so on.
void seal(SavedKind kind, std::uint64_t count, Span<std::byte> state) noexcept;

/// Checks the head of a saved state: magic number, format, kind, length and checksum. Returns `count` of
/// seal(). `where`: class whose restore_state() the error names. Throws bristle::Error.
std::uint64_t open_sealed(const char* where, SavedKind kind, Span<const std::byte> state);

/// Throws the bristle::Error "<where>::restore_state: the saved state <why>".
[[noreturn]] void refuse_saved(const char* where, const std::string& why);

}  // namespace bristle::detail
