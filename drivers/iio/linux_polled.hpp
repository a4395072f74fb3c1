#pragma once
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "drivers/iio/loss.hpp"
#include "drivers/iio/sensors.hpp"
#include "drivers/io/event_source.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::iio {

// Reads the screw sensors of a device without a buffer, one value after the other. Each read blocks for a conversion,
// often for milliseconds, so a thread of its own reads, and read() takes the finished readings. A reading is stamped
// with the middle of its conversion. An absent or lost device is retried at the next reading.
class LinuxPolled final : public io::EventSource {
 public:
  explicit LinuxPolled(DeviceChannels channels);
  ~LinuxPolled() override;

  // Delivers SourceLost once when a value cannot be read any more.
  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override { return -1; }
  std::string_view name() const override { return name_; }
  std::string_view problem() const override { return problem_; }

 private:
  struct Found;

  void run();
  std::optional<Error> readAll(std::optional<Found>& found);
  void tell(const std::optional<Error>& error);

  DeviceChannels channels_;
  std::string name_;
  std::string problem_;
  LossNotice loss_;

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Drift> readings_;  // at most kMostWaiting
  std::string problem_now_;
  bool works_{};
  bool has_failed_{};
  bool stopping_{};
  std::thread thread_;
};

}  // namespace probebox::iio
