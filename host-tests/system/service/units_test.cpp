#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>
#include <unistd.h>

#include "host-tests/support/temporary_folder.hpp"
#include "tools/tour/process.hpp"

// What `cmake --install` makes of a computer, and what systemd says of it without running it.
namespace probebox {
namespace {

namespace fs = std::filesystem;
using testing::Each;
using testing::HasSubstr;
using tour::outputOf;

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in{text};
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

class InstalledBox : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    root() = fs::path{testing::TempDir()} / ("installed-" + std::to_string(getpid()));
    setenv("DESTDIR", root().c_str(), 1);
    const auto installed = outputOf({CMAKE, "--install", BUILD_FOLDER, "--prefix", "/usr"});
    unsetenv("DESTDIR");
    ASSERT_TRUE(installed) << installed.error().what;
  }
  static void TearDownTestSuite() { fs::remove_all(root()); }
  void SetUp() override {
    if (!outputOf({"systemd-analyze", "--version"})) GTEST_SKIP() << "systemd-analyze is not installed";
  }

  static fs::path& root() {
    static fs::path path;
    return path;
  }
  static std::string unit(const char* name) { return (root() / "usr/lib/systemd/system" / name).string(); }
};

TEST_F(InstalledBox, IsWhole) {
  for (const auto* file :
       {"bin/probeboxd", "bin/probebox", "bin/probebox-usb-setup", "lib/systemd/system/probeboxd.service",
        "lib/systemd/system/probeboxd.socket", "lib/systemd/system/probebox-usb.service",
        "lib/sysusers.d/probebox.conf", "lib/udev/rules.d/60-probeboxd.rules", "lib/udev/rules.d/70-probebox.rules",
        "bin/probebox-fleet", "bin/probebox-pull",
        "lib/systemd/system/probebox-fleet.service", "lib/systemd/system/probebox-fleet.socket",
        "lib/systemd/system/probebox-pull.service", "lib/systemd/system/probebox-pull.timer",
        "lib/sysusers.d/probebox-fleet.conf", "share/probebox-fleet/prometheus/alerts.yml",
        "share/probebox-fleet/postgresql/schema.sql", "share/man/man8/probebox-fleet.8",
        "share/man/man1/probebox.1", "share/man/man8/probeboxd.8", "share/bash-completion/completions/probebox",
        "share/zsh/vendor-completions/_probebox"})
    EXPECT_TRUE(fs::exists(root() / "usr" / file)) << file;
  EXPECT_EQ(access((root() / "usr/bin/probebox-usb-setup").c_str(), X_OK), 0);
}

TEST_F(InstalledBox, HasUnitsThatSystemdUnderstandsWhole) {
  const auto said = outputOf({"sh", "-c", "systemd-analyze verify --man=no \"$@\" 2>&1 || true", "sh",
                              unit("probeboxd.service"), unit("probeboxd.socket"), unit("probebox-usb.service"),
                              unit("probebox-fleet.service"), unit("probebox-fleet.socket"),
                              unit("probebox-pull.service"), unit("probebox-pull.timer")});
  ASSERT_TRUE(said);
  // Nothing but that its programs are not installed on the computer that tests.
  EXPECT_THAT(linesOf(*said), Each(HasSubstr("No such")));
}

// The set-up needs root for the gadget; the descriptions that it needs numbers of are files that others write.
TEST_F(InstalledBox, ReadsDescriptionsAsTheDaemonsUserAndNotAsRoot) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can become another user";
  const support::TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms::all);
  const auto daemon = folder.file("daemon");
  std::ofstream{daemon} << "#!/bin/sh\n{ id -u; id -G; } >" << folder.file("who") << "\nexit 1\n";
  fs::permissions(daemon, fs::perms::owner_all | fs::perms::others_read | fs::perms::others_exec);
  const auto said = outputOf({"sh", "-c", "sh \"$0\" up --user 65534:65533 --daemon \"$1\" 2>&1; true",
                              (root() / "usr/bin/probebox-usb-setup").string(), daemon});
  ASSERT_TRUE(said) << said.error().what;
  EXPECT_THAT(*said, HasSubstr("--usb-identity' failed")) << "it stops before it touches a gadget";
  std::ifstream who{folder.file("who")};
  EXPECT_EQ((std::string{std::istreambuf_iterator<char>{who}, {}}), "65534\n65533\n");
}

TEST_F(InstalledBox, ExposesNextToNothingOfTheComputerToTheDaemon) {
  // The threshold is in tenths; half a point of it is that the daemon may ask whether the clock is synchronised.
  const auto report = outputOf(
      {"systemd-analyze", "security", "--offline=yes", "--threshold=15", "--no-pager", unit("probeboxd.service")});
  EXPECT_TRUE(report) << report.error().what;
}

TEST_F(InstalledBox, ExposesNextToNothingToWhatSpeaksToANetwork) {
  for (const auto* name : {"probebox-fleet.service", "probebox-pull.service"}) {
    const auto report =
        outputOf({"systemd-analyze", "security", "--offline=yes", "--threshold=15", "--no-pager", unit(name)});
    EXPECT_TRUE(report) << report.error().what;
  }
}

// Of an image: it runs as root, and talks to the daemon, systemd and RAUC.
TEST_F(InstalledBox, ExposesLittleToWhatConfirmsAVersion) {
  const auto report = outputOf({"systemd-analyze", "security", "--offline=yes", "--threshold=13", "--no-pager",
                                IMAGE_UNITS "/probebox-healthy.service"});
  EXPECT_TRUE(report) << report.error().what;
}

TEST_F(InstalledBox, GivesTheDaemonAUserOfItsOwn) {
  const auto said = outputOf({"systemd-sysusers", "--root=" + root().string(), "--dry-run"});
  ASSERT_TRUE(said) << said.error().what;
  EXPECT_THAT(*said, HasSubstr("Creating user 'probebox'"));
}

}  // namespace
}  // namespace probebox
