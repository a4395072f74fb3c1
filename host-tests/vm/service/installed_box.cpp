#include "installed_box.hpp"

#include <fstream>
#include <stdexcept>

#include "board/describe/parse.hpp"
#include "firmware/store/store.hpp"
#include "tools/tour/process.hpp"

namespace probebox::vm {
namespace {

// Into the guest's layer of RAM; the rest is what a package does after it is unpacked.
unsigned install() {
  shell(std::string{"cp -a "} + INSTALLED + "/. /");
  shell("systemd-sysusers probebox.conf && systemctl daemon-reload && udevadm control --reload");
  shell(std::string{"mkdir -p /etc/probebox && cp "} + BOARD + "/*.toml /etc/probebox/");
  shell(R"(sed -i 's#^links = .*#links = ["tcp:127.0.0.1:7627", "usb"]#; s#^cnc = .*#cnc = ["modbus:/dev/ttyGS0"]#')"
        " /etc/probebox/service.toml");
  shell(R"(sed -i 's#^probe = .*#probe = "usb:RX-VM"#' /etc/probebox/box.toml)");
  return static_cast<unsigned>(std::stoul(shell("id -u probebox")));
}

}  // namespace

std::string shell(const std::string& command) {
  const auto output = tour::outputOf({"sh", "-c", command});
  if (!output) throw std::runtime_error{command + ": " + output.error().what};
  return output->ends_with('\n') ? output->substr(0, output->size() - 1) : *output;
}

std::string field(const std::filesystem::path& file, const std::string& name) {
  std::ifstream lines{file};
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(name + ":")) continue;
    const auto begin = line.find_first_not_of(" \t", name.size() + 1);
    return begin == std::string::npos ? "" : line.substr(begin);
  }
  return {};
}

InstalledBox::InstalledBox()
    : lines{"probebox-vm", {"SYNC", "TOUCH", "OVERTRAVEL", "INDEX_X", "SKIP"}}, uid_{install()} {
  // Again, so that the udev rule gives them to the box and nobody else.
  lines.unplug();
  lines.plugInWithoutRights();
  shell("udevadm settle");
}

InstalledBox& InstalledBox::instance() {
  static InstalledBox box;
  return box;
}

std::string InstalledBox::property(const std::string& name) {
  return shell("systemctl show --value -p " + name + " probeboxd.service");
}

int InstalledBox::pid() {
  return std::stoi(property("MainPID"));
}

int InstalledBox::restarts() {
  return std::stoi(property("NRestarts"));
}

std::string InstalledBox::log() {
  return shell("journalctl --sync; journalctl -u probeboxd.service -o cat --no-pager");
}

std::uint64_t InstalledBox::propose() const {
  const auto descriptions = board::loadDirectory("/etc/probebox", {});
  if (!descriptions) throw std::runtime_error{descriptions.error().what};
  auto store = store::Store::open("/var/lib/probebox/results.db");
  if (!store) throw std::runtime_error{store.error().what};
  metrology::Result result;
  result.method = "delay-multi-speed";
  result.estimates = {metrology::Estimate::scalar("tau_s", 0.005, 2e-6)};
  const auto id = store->propose({.subject = "delay",
                                  .probe_serial_number = descriptions->probe.serial_number,
                                  .machine = descriptions->machine.name,
                                  .mounting = descriptions->machine.mounting},
                                 result, "{}", "2026-01-01T00:00:00Z");
  if (!id) throw std::runtime_error{id.error().what};
  shell("chown -R probebox: /var/lib/probebox");
  return *id;
}

}  // namespace probebox::vm
