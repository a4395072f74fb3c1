#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "protocol/units/outcome.hpp"
#include "tools/link/client.hpp"
#include "tools/link/uri.hpp"
#include "tools/probebox/cli/console.hpp"

// Connects to the box that the user named, or to the only one that can be found.
namespace probebox::command {

using std::chrono::milliseconds;

inline constexpr milliseconds kConnectPatience{3000};
inline constexpr milliseconds kAnswerPatience{5000};

// The address on which a box listens by default.
inline constexpr const char* kUsualUri = "tcp:127.0.0.1:7627";

// Converts a number of seconds from the command line.
milliseconds inMilliseconds(double seconds);

// Chooses the first of: `given`, PROBEBOX_URI, the only box that is announced on this computer or on USB, kUsualUri.
Outcome<link::Uri, Trouble> chooseUri(const std::string& given);

// Chooses the recording of a command: `path`, or else that of a file: URI.
Outcome<std::string, Trouble> chooseRecording(const std::string& path, const std::string& given);

// Returns the name that signs a request: `by`, or where it is empty and the box is reached by TLS, that of the own
// certificate. given: the value of -u.
std::string signer(const std::string& by, const std::string& given);

// Turns a failure into a Trouble with its exit status. After Ctrl-C every failure of a link is an interruption.
Trouble troubleOf(const link::OpenFailure& failure);
Trouble troubleOf(const link::Failure& failure, const Console& console);
Trouble usage(std::string what);
Trouble interruption();

// Patience that ends at Ctrl-C.
link::Wait patienceOf(const Console& console, milliseconds limit);

using Box = std::unique_ptr<link::Client>;

// Connects and shakes hands. `listener` may be null and outlives the box.
Outcome<Box, Trouble> openBox(const link::Uri& uri, const Console& console, milliseconds patience = kConnectPatience,
                              link::StreamListener* listener = nullptr, const link::ClientOptions& options = {});
// The same for the value of -u. Trouble for a recording: the command needs a box that answers.
Outcome<Box, Trouble> openBox(const std::string& given, const Console& console);

// Sends one request and waits for its answer.
template <class Operation>
Outcome<typename Operation::Answer, Trouble> ask(link::Client& box, const Console& console,
                                                 const typename Operation::Request& request = {}) {
  auto answer = box.request<Operation>(request, patienceOf(console, kAnswerPatience));
  if (!answer) return troubleOf(answer.error(), console);
  return std::move(answer).value();
}

// Ends the reading of a list that comes in parts even if the box is faulty: each part must have higher numbers than the
// one before it, and there may be at most so many.
class ListWatch {
 public:
  static constexpr std::uint64_t kMostParts = 10'000;

  explicit ListWatch(std::uint64_t most_parts = kMostParts) : most_parts_{most_parts} {}

  // first, last: numbers of the first and last item of this part. Trouble: the list would never end.
  std::optional<Trouble> part(std::uint64_t first, std::uint64_t last);
  // A part that may go on with the last item of the one before it, such as further values of a result.
  std::optional<Trouble> furtherPart(std::uint64_t last);

 private:
  Trouble endless() const;

  std::uint64_t most_parts_;
  std::uint64_t parts_{};
  std::uint64_t last_{};
};

}  // namespace probebox::command
