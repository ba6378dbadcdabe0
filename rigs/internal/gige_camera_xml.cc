#include "rigs/internal/gige_registers.h"

#include <fmt/format.h>
#include <string_view>
#include <utility>
#include <vector>

namespace nacre::rigs::internal {
namespace {

using Entries = std::vector<std::pair<std::string_view, std::uint32_t>>;

std::string Register(std::string_view name, std::uint32_t address) {
  return fmt::format(
      "<IntReg Name=\"{}\"><Address>0x{:X}</Address><Length>4</Length>"
      "<AccessMode>RW</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable>"
      "<Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>\n",
      name,
      address);
}

struct IntegerRange {
  int min = 0;
  int max = 0;
  int step = 1;
};

std::string Integer(std::string_view name, std::uint32_t address, IntegerRange range) {
  return fmt::format(
             "<Integer Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Register</pValue>"
             "<Min>{1}</Min><Max>{2}</Max><Inc>{3}</Inc></Integer>\n",
             name,
             range.min,
             range.max,
             range.step) +
         Register(fmt::format("{}Register", name), address);
}

// Whole units in the register, a floating-point feature above it.
std::string Float(std::string_view name, std::uint32_t address, IntegerRange range) {
  return fmt::format(
             "<Float Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Converter</pValue>"
             "<Min>{1}</Min><Max>{2}</Max></Float>\n"
             "<Converter Name=\"{0}Converter\"><FormulaTo>FROM</FormulaTo>"
             "<FormulaFrom>TO</FormulaFrom><pValue>{0}Register</pValue></Converter>\n",
             name,
             range.min,
             range.max) +
         Register(fmt::format("{}Register", name), address);
}

std::string Enumeration(std::string_view name,
                        std::uint32_t address,
                        const Entries& entries) {
  std::string text =
      fmt::format("<Enumeration Name=\"{}\" NameSpace=\"Standard\">", name);
  for (const auto& [entry, value] : entries) {
    text += fmt::format(
        "<EnumEntry Name=\"{}\" NameSpace=\"Standard\"><Value>{}</Value></EnumEntry>",
        entry,
        value);
  }
  return text + fmt::format("<pValue>{}Register</pValue></Enumeration>\n", name) +
         Register(fmt::format("{}Register", name), address);
}

std::string Command(std::string_view name, std::uint32_t address, int value) {
  return fmt::format(
      "<Command Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Register</pValue>"
      "<CommandValue>{1}</CommandValue></Command>\n{2}",
      name,
      value,
      Register(fmt::format("{}Register", name), address));
}

}  // namespace

std::string GigeCameraXml(int width, int height) {
  constexpr std::string_view kFeatures[] = {"Width",
                                            "Height",
                                            "OffsetX",
                                            "OffsetY",
                                            "PixelFormat",
                                            "PayloadSize",
                                            "ExposureTime",
                                            "Gain",
                                            "TriggerMode",
                                            "AcquisitionStart",
                                            "AcquisitionStop",
                                            "AcquisitionMode",
                                            "TriggerSource",
                                            "TriggerSoftware",
                                            "TriggerSelector",
                                            "UserDefinedValue",
                                            "DeviceTemperature"};
  std::string features;
  for (const std::string_view feature : kFeatures) {
    features += fmt::format("<pFeature>{}</pFeature>", feature);
  }
  return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
         "<RegisterDescription ModelName=\"GigeTwin\" VendorName=\"Nacre\" "
         "StandardNameSpace=\"GEV\" SchemaMajorVersion=\"1\" SchemaMinorVersion=\"0\" "
         "SchemaSubMinorVersion=\"1\" MajorVersion=\"1\" MinorVersion=\"0\" "
         "SubMinorVersion=\"0\" ToolTip=\"\" "
         "ProductGuid=\"1B7E6C5A-91A6-4F5B-9C0C-6B1D6F4F1C11\" "
         "VersionGuid=\"1B7E6C5A-91A6-4F5B-9C0C-6B1D6F4F1C12\" "
         "xmlns=\"http://www.genicam.org/GenApi/Version_1_0\">\n"
         "<Category Name=\"Root\" NameSpace=\"Standard\">" +
         features + "</Category>\n" + Integer("Width", kWidth, {8, width, 4}) +
         Integer("Height", kHeight, {8, height, 4}) +
         Integer("OffsetX", kOffsetX, {0, width - 8, 4}) +
         Integer("OffsetY", kOffsetY, {0, height - 8, 4}) +
         Integer("PayloadSize", kPayload, {0, 1 << 28, 1}) +
         Enumeration("PixelFormat",
                     kPixelFormat,
                     {{"Mono8", 0x01080001U},
                      {"Mono12", 0x01100005U},
                      {"Mono12p", 0x010C0047U},
                      {"Mono16", 0x01100007U},
                      {"BayerRG8", 0x01080009U},
                      {"BayerGB12", 0x01100012U},
                      {"BayerRG12p", 0x010C0059U},
                      {"BayerBG16", 0x01100031U},
                      {"RGB8", 0x02180014U}}) +
         Float("ExposureTime", kExposure, {10, 1'000'000, 1}) +
         Float("Gain", kGain, {0, 24, 1}) +
         Enumeration("AcquisitionMode", kAcquisitionMode, {{"Continuous", 0}}) +
         Command("AcquisitionStart", kAcquisition, 1) +
         Command("AcquisitionStop", kAcquisition, 0) +
         Enumeration("TriggerSelector", kTriggerSelector, {{"FrameStart", 0}}) +
         Enumeration("TriggerMode", kTriggerMode, {{"Off", 0}, {"On", 1}}) +
         Enumeration("TriggerSource", kTriggerSource, {{"Software", 0}, {"Line1", 1}}) +
         Command("TriggerSoftware", kTriggerSoftware, 1) +
         Integer("UserDefinedValue", kUserDefinedValue, {0, 0x7FFFFFFF, 1}) +
         Float("DeviceTemperature", kTemperature, {-50, 150, 1}) +
         "<Port Name=\"Device\" NameSpace=\"Standard\"></Port>\n"
         "</RegisterDescription>\n";
}

}  // namespace nacre::rigs::internal
