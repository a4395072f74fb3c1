#include "drivers/serial/linux_serial.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <optional>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <system_error>
#include <termios.h>
#include <utility>

#include "drivers/io/descriptor.hpp"
#include "drivers/serial/transceiver.hpp"

namespace probebox::serial {
namespace {

// The kernel's names of kRates.
constexpr std::array kSpeeds{
    std::pair{1200U, B1200},       std::pair{2400U, B2400},       std::pair{4800U, B4800},
    std::pair{9600U, B9600},       std::pair{19200U, B19200},     std::pair{38400U, B38400},
    std::pair{57600U, B57600},     std::pair{115200U, B115200},   std::pair{230400U, B230400},
    std::pair{460800U, B460800},   std::pair{500000U, B500000},   std::pair{576000U, B576000},
    std::pair{921600U, B921600},   std::pair{1000000U, B1000000}, std::pair{1152000U, B1152000},
    std::pair{1500000U, B1500000}, std::pair{2000000U, B2000000}, std::pair{2500000U, B2500000},
    std::pair{3000000U, B3000000}, std::pair{3500000U, B3500000}, std::pair{4000000U, B4000000}};

std::optional<speed_t> speedOf(unsigned baud) {
  for (const auto& [rate, speed] : kSpeeds) {
    if (rate == baud) return speed;
  }
  return std::nullopt;
}

class SerialPipe final : public io::BytePipe {
 public:
  SerialPipe(io::Descriptor line, std::string name) : line_{std::move(line)}, name_{std::move(name)} {}

  io::Transfer read(std::span<std::byte> into) override {
    if (into.empty()) return {0, state_};
    return moved(::read(line_.get(), into.data(), into.size()));
  }
  io::Transfer write(std::span<const std::byte> from) override {
    if (from.empty()) return {0, state_};
    return moved(::write(line_.get(), from.data(), from.size()));
  }
  int descriptor() const override { return line_.get(); }
  std::string_view name() const override { return name_; }

 private:
  // With VMIN = 1 an idle line says EAGAIN; 0 bytes and EIO are a hang-up.
  io::Transfer moved(ssize_t bytes) {
    if (bytes > 0) return {static_cast<std::size_t>(bytes), state_};
    if (bytes < 0 && (errno == EAGAIN || errno == EINTR)) return {0, state_};
    state_ = io::PipeState::closed;
    return {0, state_};
  }

  io::Descriptor line_;
  std::string name_;
  io::PipeState state_{io::PipeState::open};
};

Error openFailure(const std::string& path, int code) {
  switch (code) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
      return {path + ": there is no such serial line; check the cable and the name (ls -l /dev/serial/by-id)"};
    case EACCES:
    case EPERM:
      return {path + ": no permission; add your user to the group that owns it (usually: sudo adduser $USER dialout)"};
    case EBUSY:
      return {path + ": another process uses this serial line; stop it first (fuser -v " + path + ")"};
    default:
      return {path + ": " + std::strerror(code)};
  }
}

// Majors of Unix 98 slaves.
bool isPseudoTerminal(dev_t device) {
  return major(device) >= 136 && major(device) <= 143;
}

bool isPseudoTerminal(int fd) {
  struct stat status {};
  return fstat(fd, &status) == 0 && isPseudoTerminal(status.st_rdev);
}

// The box's end of a serial line over USB (CDC-ACM): there is no wire that could have a speed or parity, and its driver
// keeps whatever it says about them.
bool isUsbGadget(int fd) {
  struct stat status {};
  if (fstat(fd, &status) != 0) return false;
  const auto node =
      "/sys/dev/char/" + std::to_string(major(status.st_rdev)) + ":" + std::to_string(minor(status.st_rdev));
  std::error_code unknown;
  return std::filesystem::read_symlink(node, unknown).filename().string().starts_with("ttyGS");
}

bool claim(int fd) {
  if (flock(fd, LOCK_EX | LOCK_NB) != 0) return false;
  // Keeps out programs that know no locks. A pseudo terminal that something holds open would stay exclusive after this
  // process was killed, so there the lock must do.
  return isPseudoTerminal(fd) || ioctl(fd, TIOCEXCL) == 0;
}

void setFormat(termios& line, const Settings& settings) {
  cfmakeraw(&line);
  line.c_cflag &= ~static_cast<tcflag_t>(CSIZE | PARENB | PARODD | CSTOPB | CRTSCTS);
  line.c_cflag |= CLOCAL | CREAD | (settings.data_bits == 7 ? CS7 : CS8);
  if (settings.parity != Parity::none) line.c_cflag |= PARENB;
  if (settings.parity == Parity::odd) line.c_cflag |= PARODD;
  if (settings.stop_bits == 2) line.c_cflag |= CSTOPB;
  // The end of the program lowers RTS, which has to turn the transceiver to listening, or not to happen.
  if (settings.rs485.by == Turning::rts)
    line.c_cflag = settings.rs485.active_high ? line.c_cflag | HUPCL : line.c_cflag & ~static_cast<tcflag_t>(HUPCL);
  line.c_iflag |= settings.parity != Parity::none ? INPCK | IGNPAR : IGNPAR;
  line.c_cc[VMIN] = 1;
  line.c_cc[VTIME] = 0;
}

bool configure(int fd, const Settings& settings, speed_t speed) {
  termios line{};
  if (tcgetattr(fd, &line) != 0) return false;
  setFormat(line, settings);
  // These have neither parity nor seven bits, and some C libraries make an error of that.
  const bool is_gadget = isUsbGadget(fd);
  if (is_gadget || isPseudoTerminal(fd)) line.c_cflag = (line.c_cflag & ~static_cast<tcflag_t>(PARENB | CSIZE)) | CS8;
  if (cfsetispeed(&line, speed) != 0 || cfsetospeed(&line, speed) != 0) return false;
  if (tcsetattr(fd, TCSANOW, &line) != 0) return false;
  if (is_gadget) return true;
  // tcsetattr succeeds when any part of it was taken.
  termios taken{};
  return tcgetattr(fd, &taken) == 0 && cfgetospeed(&taken) == speed &&
         (taken.c_cflag & (CSIZE | CSTOPB | PARENB)) == (line.c_cflag & (CSIZE | CSTOPB | PARENB));
}

// True for devices of the kernel's class tty, if that can be seen, but for /dev/tty and /dev/ptmx, which are no lines.
bool mayBeTerminal(dev_t device) {
  constexpr unsigned kAuxiliary = 5;
  if (major(device) == kAuxiliary && minor(device) != 1) return false;
  if (isPseudoTerminal(device)) return true;
  const std::filesystem::path all{"/sys/dev/char"};
  const auto node = all / (std::to_string(major(device)) + ":" + std::to_string(minor(device)));
  std::error_code error;
  const auto subsystem = std::filesystem::read_symlink(node / "subsystem", error);
  return error ? !std::filesystem::exists(all, error) : subsystem.filename() == "tty";
}

const char* kindOf(mode_t mode) {
  if (S_ISREG(mode)) return "an ordinary file";
  if (S_ISDIR(mode)) return "a folder";
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "another device";
}

}  // namespace

std::optional<Error> whyNoLine(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return std::nullopt;
  if (S_ISCHR(status.st_mode) && mayBeTerminal(status.st_rdev)) return std::nullopt;
  return Error{path + ": this is " + kindOf(status.st_mode) +
               ", no serial line; name a terminal device such as /dev/ttyS1"};
}

Outcome<std::unique_ptr<io::BytePipe>> openSerial(const std::string& path, const Settings& settings) {
  const auto speed = speedOf(settings.baud);
  if (!speed)
    return Error{path + ": " + std::to_string(settings.baud) +
                 " baud is not a standard rate; use 9600, 19200 or 115200"};
  if (const auto refused = whyNoLine(path)) return *refused;
  io::Descriptor line{::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)};
  if (!line) return openFailure(path, errno);
  if (isatty(line.get()) == 0)
    return Error{path + ": this is not a serial line; name a terminal device such as /dev/ttyS1"};
  if (!claim(line.get())) return openFailure(path, EBUSY);
  const auto by = settings.rs485.by;
  // Opening a line has raised its RTS; openTransceiver says where it has none.
  int rts = TIOCM_RTS;
  if (by == Turning::rts && settings.rs485.active_high) ioctl(line.get(), TIOCMBIC, &rts);
  if (!configure(line.get(), settings, *speed)) {
    return Error{path + ": the line does not support " + describe(settings) +
                 "; choose a speed and format that it supports, such as baud=115200"};
  }
  const auto refused = [&path](const Error& error) { return Error{path + ": " + error.what}; };
  if (by == Turning::kernel) {
    if (const auto taken = turnByKernel(line.get(), settings.rs485); !taken) return refused(taken.error());
  }
  const int descriptor = line.get();
  auto pipe = std::unique_ptr<io::BytePipe>{std::make_unique<SerialPipe>(std::move(line), path)};
  if (by == Turning::none || by == Turning::kernel) return pipe;
  auto transceiver = openTransceiver(descriptor, settings.rs485);
  if (!transceiver) return refused(transceiver.error());
  return turnedPipe(std::move(pipe), std::move(*transceiver), settings);
}

}  // namespace probebox::serial
