#pragma once
// Mutants of JSON text that are still JSON, so that they get past the parser.

#include <cstddef>
#include <cstdint>

namespace energymargin::fuzz {

//! As LLVMFuzzerCustomMutator: changes the text in place, to at most `most` bytes, and returns its new size. Now and
//! then, and where the text is no JSON, it changes bytes.
std::size_t mutate_json(std::uint8_t* data, std::size_t size, std::size_t most, unsigned seed);

}  // namespace energymargin::fuzz
