#pragma once

#include <cstdint>
#include <string>

namespace nacre::rigs::internal {

// Bootstrap registers of GigE Vision 1.2 that a driver looks at.
enum GigeRegister : std::uint32_t {
  kVersion = 0x0000,
  kDeviceMode = 0x0004,
  kMacHigh = 0x0008,
  kMacLow = 0x000C,
  kCurrentIp = 0x0024,
  kManufacturer = 0x0048,
  kModel = 0x0068,
  kDeviceVersion = 0x0088,
  kSerial = 0x00D8,
  kXmlUrl = 0x0200,
  kInterfaceCount = 0x0600,
  kStreamCount = 0x0904,
  kCapability = 0x0934,
  kHeartbeatMs = 0x0938,
  kTickFrequencyLow = 0x0940,
  kControl = 0x0A00,
  kStreamPort = 0x0D00,
  kPacketSize = 0x0D04,
  kStreamAddress = 0x0D18,
  // The camera's own, named by its GenICam description.
  kWidth = 0x8000,
  kHeight = 0x8004,
  kOffsetX = 0x8008,
  kOffsetY = 0x800C,
  kPixelFormat = 0x8010,
  kExposure = 0x8014,
  kGain = 0x8018,
  kAcquisition = 0x801C,
  kAcquisitionMode = 0x8020,
  kTriggerMode = 0x8024,
  kTriggerSource = 0x8028,
  kTriggerSoftware = 0x802C,
  kTriggerSelector = 0x8030,
  kPayload = 0x8034,
  kUserDefinedValue = 0x8038,
  kTemperature = 0x803C,
  kXml = 0x10000,
};

/// The GenICam description of the registers above, for a sensor of this size.
std::string GigeCameraXml(int width, int height);

}  // namespace nacre::rigs::internal
