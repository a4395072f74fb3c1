#include "recording_entry.hpp"

#include <sstream>
#include <string>

#include "require.hpp"
#include "tools/link/recording.hpp"

namespace {

using namespace probebox;
using fuzz::require;

class Listener : public link::StreamListener {
 public:
  void onBlock(const link::DecodedBlock& block) override {
    require(block.columns.size() == block.descriptor.channels.size() * block.header.count);
  }
};

}  // namespace

int feedRecording(const std::uint8_t* data, std::size_t size) {
  fuzz::feeding({data, size});
  std::istringstream in{std::string{reinterpret_cast<const char*>(data), size}};
  Listener listener;
  const auto end = link::readRecording(in, listener);
  if (!end) {
    require(!end.error().what.empty());
    return 0;
  }
  require(end->bytes == size && end->cut_bytes <= size);
  return 0;
}
