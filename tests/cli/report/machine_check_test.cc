#include "cli/machine_check.h"

#include "core/atomic_file.h"
#include "tests/support/temp_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <unistd.h>

namespace nacre::cli {
namespace {

using nacre::testing::TempFolder;
using ::testing::HasSubstr;
using State = Finding::State;

void Write(const std::filesystem::path& path, const std::string& text) {
  std::filesystem::create_directories(path.parent_path());
  WriteFile(path, text);
}

const Finding* Find(const std::vector<Finding>& findings, const std::string& name) {
  const auto found = std::find_if(findings.begin(),
                                  findings.end(),
                                  [&](const Finding& f) { return f.name == name; });
  return found == findings.end() ? nullptr : &*found;
}

TEST(MachineCheck, AnEmptyMachineIsNoError) {
  const TempFolder root;
  const std::vector<Finding> findings = CheckMachine(root.path(), root.path());
  ASSERT_NE(Find(findings, "laser"), nullptr);
  EXPECT_EQ(Find(findings, "laser")->state, State::kNote);
  EXPECT_EQ(Find(findings, "model")->value, "unknown");
  EXPECT_EQ(Find(findings, "available")->value, "unknown");
  for (const Finding& finding : findings) {
    EXPECT_NE(finding.state, State::kProblem) << finding.name;
  }
}

TEST(MachineCheck, AHeliosWithoutPermissionIsAProblemWithItsRemedy) {
  const TempFolder root;
  const auto device = root / "sys/bus/usb/devices/1-4";
  Write(device / "idVendor", "1209\n");
  Write(device / "idProduct", "e500\n");
  Write(device / "busnum", "1\n");
  Write(device / "devnum", "7\n");
  const Finding* helios = nullptr;
  std::vector<Finding> findings = CheckMachine(root.path(), root.path());
  helios = Find(findings, "Helios laser DAC");
  ASSERT_NE(helios, nullptr);
  EXPECT_EQ(helios->state, State::kProblem);
  EXPECT_THAT(helios->value, HasSubstr("dev/bus/usb/001/007"));
  EXPECT_THAT(helios->advice, HasSubstr("70-nacre.rules"));

  Write(root / "dev/bus/usb/001/007", "");
  findings = CheckMachine(root.path(), root.path());
  EXPECT_EQ(Find(findings, "Helios laser DAC")->state, State::kGood);
}

TEST(MachineCheck, OtherUsbDevicesAreNoneOfItsBusiness) {
  const TempFolder root;
  Write(root / "sys/bus/usb/devices/1-1/idVendor", "046d\n");
  Write(root / "sys/bus/usb/devices/1-1/idProduct", "c52b\n");
  Write(root / "sys/bus/usb/devices/1-0:1.0/bInterfaceClass", "09\n");
  const std::vector<Finding> findings = CheckMachine(root.path(), root.path());
  EXPECT_NE(Find(findings, "laser"), nullptr);
}

TEST(MachineCheck, AUsbCameraWithoutPermissionIsAProblem) {
  const TempFolder root;
  const std::filesystem::path devices = root / "sys/bus/usb/devices";
  for (const char* protocol : {"00", "01", "02"}) {  // control, events, frames
    const auto interface = devices / (std::string("2-1:1.") + protocol[1]);
    Write(interface / "bInterfaceClass", "ef\n");
    Write(interface / "bInterfaceSubClass", "05\n");
    Write(interface / "bInterfaceProtocol", std::string(protocol) + "\n");
  }
  Write(devices / "2-1/product", "Some Camera\n");
  Write(devices / "2-1/busnum", "2\n");
  Write(devices / "2-1/devnum", "5\n");
  Write(devices / "2-1/speed", "480\n");
  std::vector<Finding> findings = CheckMachine(root.path(), root.path());
  ASSERT_NE(Find(findings, "Some Camera"), nullptr);
  EXPECT_EQ(Find(findings, "Some Camera")->state, State::kProblem);
  EXPECT_THAT(Find(findings, "Some Camera")->advice,
              HasSubstr("70-nacre-camera.rules"));
  EXPECT_NE(Find(findings, "laser"), nullptr) << "a camera is no laser";
  Write(root / "dev/bus/usb/002/005", "");
  findings = CheckMachine(root.path(), root.path());
  EXPECT_EQ(Find(findings, "Some Camera")->state, State::kNote);
  EXPECT_THAT(Find(findings, "Some Camera")->advice, HasSubstr("no USB 3 port"));
  Write(devices / "2-1/speed", "5000\n");
  findings = CheckMachine(root.path(), root.path());
  EXPECT_EQ(Find(findings, "Some Camera")->state, State::kGood);
}

TEST(MachineCheck, InterfacesWithoutJumboFramesGetAHint) {
  const TempFolder root;
  for (const char* name : {"eth0", "eth1", "docker0", "lo"}) {
    Write(root / "sys/class/net" / name / "mtu",
          std::string(name) == "eth1" ? "9000\n" : "1500\n");
    Write(root / "sys/class/net" / name / "operstate", "up\n");
  }
  for (const char* name : {"eth0", "eth1"}) {
    std::filesystem::create_directories(root / "sys/class/net" / name / "device");
  }
  Write(root / "sys/class/net/eth1/speed", "1000\n");
  Write(root / "proc/sys/net/core/rmem_max", "212992\n");
  const std::vector<Finding> findings = CheckMachine(root.path(), root.path());
  EXPECT_EQ(Find(findings, "eth0")->state, State::kNote);
  EXPECT_THAT(Find(findings, "eth0")->advice,
              HasSubstr("ip link set dev eth0 mtu 9000"));
  EXPECT_EQ(Find(findings, "eth1")->state, State::kGood);
  EXPECT_EQ(Find(findings, "eth1")->value, "up, MTU 9000, 1000 Mbit/s");
  EXPECT_EQ(Find(findings, "docker0"), nullptr);
  EXPECT_EQ(Find(findings, "lo"), nullptr);
  EXPECT_THAT(Find(findings, "receive buffer")->advice, HasSubstr("rmem_max"));
}

TEST(MachineCheck, ReadsProcessorAndMemory) {
  const TempFolder root;
  Write(root / "proc/cpuinfo", "processor\t: 0\nmodel name\t: Test 9000\n");
  Write(root / "proc/meminfo",
        "MemTotal:       16000000 kB\nMemAvailable:    1000000 kB\n");
  const std::vector<Finding> findings = CheckMachine(root.path(), root.path());
  EXPECT_EQ(Find(findings, "model")->value, "Test 9000");
  EXPECT_EQ(Find(findings, "available")->value, "1.0 of 16.4 GB");
  EXPECT_EQ(Find(findings, "available")->state, State::kNote);
}

}  // namespace
}  // namespace nacre::cli
