#pragma once
#include <cstddef>
#include <optional>

#include "firmware/stream/sample_ring.hpp"

namespace probebox::stream {

// The last seconds of the stream, shared by all links of a box, from which a reconnecting host resumes. The box pushes
// every block and gap here first, and then offers it to the sessions.
class History {
 public:
  History(std::size_t bytes, std::size_t pieces) : ring_{bytes, pieces} {}

  // Makes room by forgetting the oldest. A hole before the block is kept as a loss of the clock (its index jumped); a
  // block that goes back in index is ignored.
  void push(const EncodedBlock& block);
  void push(const GapNotice& gap);

  bool empty() const { return ring_.empty(); }
  SampleIndex oldest() const { return ring_.empty() ? ring_.next() : ring_.front().first; }
  SampleIndex next() const { return ring_.next(); }
  // False until the first push.
  bool begun() const { return begun_; }
  std::optional<Piece> find(SampleIndex sample) const { return ring_.find(sample); }

 private:
  bool reach(SampleIndex first);

  SampleRing ring_;
  bool begun_{};
};

}  // namespace probebox::stream
