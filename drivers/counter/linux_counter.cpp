#include "drivers/counter/linux_counter.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <fstream>
#include <linux/counter.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/timerfd.h>
#include <unistd.h>

namespace probebox::counter {
namespace {

const std::filesystem::path kDevices{"/sys/bus/counter/devices"};
constexpr std::size_t kEventsAtOnce = 64;

MonoTime now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec);
}

std::string textOf(const std::filesystem::path& file) {
  std::ifstream in{file};
  std::string line;
  std::getline(in, line);
  return line;
}

std::uint8_t eventOf(board::LatchedBy latched_by) {
  switch (latched_by) {
    case board::LatchedBy::index:
      return COUNTER_EVENT_INDEX;
    case board::LatchedBy::capture:
      return COUNTER_EVENT_CAPTURE;
    default:
      return COUNTER_EVENT_CHANGE_OF_STATE;
  }
}

std::string allNames() {
  std::string names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator{kDevices, error})
    names +=
        (names.empty() ? "" : ", ") + entry.path().filename().string() + " (" + textOf(entry.path() / "name") + ")";
  return names;
}

std::string reasonOf(int code) {
  if (code == EACCES || code == EPERM) return "no permission; install 60-probeboxd.rules (docs/service.md)";
  if (code == EBUSY) return "another process holds it; stop that";
  return std::strerror(code);
}

}  // namespace

LinuxCounter::LinuxCounter(const board::CounterEncoder& described, char axis, Nanoseconds interval)
    : described_{described}, section_{std::string{"[encoder."} + axis + "] of box.toml"}, interval_{interval} {}

Outcome<OpenedCount> LinuxCounter::open() {
  close();
  TRY(find());
  if (auto error = whyNotCounting()) return *error;
  value_ = io::Descriptor{::open((folder_ / "count").c_str(), O_RDONLY | O_CLOEXEC)};
  if (!value_) return Error{(folder_ / "count").string() + ": " + reasonOf(errno)};
  ready_ = io::Descriptor{epoll_create1(EPOLL_CLOEXEC)};
  if (!isLatched()) TRY(startTimer());
  if (isLatched() || described_.has_index) {
    if (const auto opened = openEvents(); !opened) {
      close();
      return opened.error();
    }
  }
  return OpenedCount{.ceiling = ceiling()};
}

void LinuxCounter::close() {
  value_ = io::Descriptor{};
  events_ = io::Descriptor{};
  timer_ = io::Descriptor{};
  ready_ = io::Descriptor{};
}

// By path, by number, or by the name that its driver gave it.
Outcome<void> LinuxCounter::find() {
  const auto& wanted = described_.device;
  const auto file = std::filesystem::path{wanted}.filename().string();
  std::error_code error;
  device_.clear();
  if (std::filesystem::exists(kDevices / file, error)) device_ = file;
  for (const auto& entry : std::filesystem::directory_iterator{kDevices, error})
    if (device_.empty() && textOf(entry.path() / "name") == wanted) device_ = entry.path().filename().string();
  if (device_.empty()) {
    const auto names = allNames();
    return Error{wanted + ": there is no such counter; " +
                 (names.empty() ? "this kernel has none: load the counter's driver" : "there are " + names) +
                 "; 'device' in " + section_ + " says which is read"};
  }
  folder_ = kDevices / device_ / ("count" + std::to_string(described_.count));
  if (!std::filesystem::exists(folder_, error))
    return Error{wanted + " has no count" + std::to_string(described_.count) + "; ls " + (kDevices / device_).string() +
                 " lists what it has, 'count' in " + section_ + " says which is read"};
  return {};
}

std::string LinuxCounter::attribute(const std::string& name) const {
  return textOf(folder_ / name);
}

std::optional<std::uint64_t> LinuxCounter::ceiling() const {
  const auto text = attribute("ceiling");
  std::uint64_t value = 0;
  if (std::from_chars(text.data(), text.data() + text.size(), value).ec != std::errc{}) return std::nullopt;
  return value;
}

// A device that is set up to count something else gives numbers that look well.
std::optional<Error> LinuxCounter::whyNotCounting() const {
  const auto set = [&](const std::string& name, const std::string& value) {
    return ": echo " + value + " > " + (folder_ / name).string() + ", or let the udev rule of the board do it";
  };
  const auto function = attribute("function"), mode = attribute("count_mode");
  if (attribute("enable") == "0") return Error{described_.device + " is not enabled" + set("enable", "1")};
  if (function == "increase" || function == "decrease")
    return Error{described_.device + " counts pulses, and no direction (function \"" + function + "\")" +
                 set("function", "\"quadrature x4\"")};
  if (!mode.empty() && mode != "normal" && mode != "modulo-n")
    return Error{described_.device + " stops at its ends (count_mode \"" + mode + "\")" + set("count_mode", "normal")};
  if (ceiling() == 0) {
    const unsigned bits = described_.bits > 0 && described_.bits < 64 ? described_.bits : 32;
    return Error{described_.device + " has a ceiling of 0, so that its count stays at 0" +
                 set("ceiling", std::to_string((std::uint64_t{1} << bits) - 1))};
  }
  return std::nullopt;
}

Outcome<void> LinuxCounter::startTimer() {
  timer_ = io::Descriptor{timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC)};
  // On a grid of whole intervals: the timers of all axes end together.
  const std::int64_t first_ns = (toNs(now()) / interval_.count() + 2) * interval_.count();
  constexpr std::int64_t kSecond = 1'000'000'000;
  itimerspec times{};
  times.it_value = {first_ns / kSecond, first_ns % kSecond};
  times.it_interval = {interval_.count() / kSecond, interval_.count() % kSecond};
  epoll_event readable{};
  readable.events = EPOLLIN;
  if (!timer_ || timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &times, nullptr) != 0 ||
      epoll_ctl(ready_.get(), EPOLL_CTL_ADD, timer_.get(), &readable) != 0)
    return Error{described_.device + ": no timer: " + std::strerror(errno)};
  return {};
}

Outcome<void> LinuxCounter::openEvents() {
  const std::string node = "/dev/" + device_;
  events_ = io::Descriptor{::open(node.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)};
  if (!events_) return Error{node + ": " + reasonOf(errno)};
  if (isLatched()) {
    TRY(watch(eventOf(described_.latched_by), described_.latch_channel,
              described_.latched_value == board::LatchedValue::capture));
  }
  if (described_.has_index) {
    TRY(watch(COUNTER_EVENT_INDEX, described_.index_channel, false));
  }
  epoll_event readable{};
  readable.events = EPOLLIN;
  if (ioctl(events_.get(), COUNTER_ENABLE_EVENTS_IOCTL) != 0 ||
      epoll_ctl(ready_.get(), EPOLL_CTL_ADD, events_.get(), &readable) != 0)
    return Error{node + ": its events cannot be had: " + std::strerror(errno)};
  return {};
}

Outcome<void> LinuxCounter::watch(std::uint8_t event, std::uint8_t channel, bool captured) {
  counter_watch wanted{};
  wanted.component = {
      .type = COUNTER_COMPONENT_COUNT, .scope = COUNTER_SCOPE_COUNT, .parent = described_.count, .id = 0};
  wanted.event = event;
  wanted.channel = channel;
  if (captured) {
    const auto id = attribute("capture_component_id");
    wanted.component.type = COUNTER_COMPONENT_EXTENSION;
    const auto read = std::from_chars(id.data(), id.data() + id.size(), wanted.component.id);
    if (id.empty() || read.ec != std::errc{})
      return Error{described_.device + " captures no value of its own: write latched_value = \"count\" in " + section_};
  }
  if (ioctl(events_.get(), COUNTER_ADD_WATCH_IOCTL, &wanted) == 0) return {};
  const std::string key = event == COUNTER_EVENT_INDEX && described_.has_index ? "'index'" : "'latched_by'";
  return Error{described_.device + " does not report this event (" + std::strerror(errno) +
               "): its driver knows other ones; change " + key + " or its channel in " + section_ +
               ", or poll the count and wire the mark to an [[index]] line"};
}

// Another process that watches the device changes what it reports.
Happened LinuxCounter::happenedAt(const counter_watch& watch) const {
  const auto is = [&](std::uint8_t event, std::uint8_t channel) {
    return watch.component.parent == described_.count && watch.event == event && watch.channel == channel;
  };
  if (described_.has_index && is(COUNTER_EVENT_INDEX, described_.index_channel)) return Happened::index;
  if (isLatched() && is(eventOf(described_.latched_by), described_.latch_channel)) return Happened::latched;
  return Happened::foreign;
}

std::optional<std::size_t> LinuxCounter::readEvents(std::span<CounterEvent> into) {
  if (!events_) return 0;
  std::array<counter_event, kEventsAtOnce> raw{};
  const std::size_t wanted = std::min(into.size(), raw.size()) * sizeof(counter_event);
  ssize_t got = 0;
  do {
    got = ::read(events_.get(), raw.data(), wanted);
  } while (got < 0 && errno == EINTR);
  if (got < 0 && errno == EAGAIN) return 0;
  if (got <= 0) return std::nullopt;
  const std::size_t count = static_cast<std::size_t>(got) / sizeof(counter_event);
  for (std::size_t i = 0; i < count; ++i) {
    into[i] = {.what = happenedAt(raw[i].watch),
               .value = raw[i].value,
               .is_valid = raw[i].status == 0,
               .at = monoTime(static_cast<std::int64_t>(raw[i].timestamp))};
  }
  return count;
}

std::optional<PolledCount> LinuxCounter::poll() {
  std::array<char, 32> text{};
  PolledCount polled;
  ssize_t got = 0;
  do {
    polled.before = now();
    got = pread(value_.get(), text.data(), text.size(), 0);
    polled.after = now();
  } while (got < 0 && errno == EINTR);
  if (got <= 0) return std::nullopt;
  if (std::from_chars(text.data(), text.data() + got, polled.value).ec != std::errc{}) return std::nullopt;
  return polled;
}

bool LinuxCounter::isDue(MonoTime /*now*/) {
  std::uint64_t ended = 0;
  return timer_ && ::read(timer_.get(), &ended, sizeof(ended)) == sizeof(ended);
}

}  // namespace probebox::counter
