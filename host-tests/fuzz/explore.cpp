#include PROBEBOX_ENTRY

// What libFuzzer calls; the entry of a target is chosen by CMakeLists.txt.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return PROBEBOX_FEED(data, size);
}
