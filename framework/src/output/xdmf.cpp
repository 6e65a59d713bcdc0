#include "output/xdmf.hpp"

#include <fmt/format.h>

#include "output_fields/state_field.hpp"

namespace perikit {

namespace {

/// Text as an XML attribute; characters that XML 1.0 forbids become spaces.
std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return result;
}

std::string data_item(const std::string& file, const std::string& name, std::size_t points, int width, const char* number) {
  const std::string shape = width > 1 ? fmt::format("{} {}", points, width) : fmt::format("{}", points);
  return fmt::format("<DataItem Format=\"HDF\" NumberType=\"{}\" Precision=\"8\" Dimensions=\"{}\">{}:/{}</DataItem>", number,
                     shape, file, escaped(name));
}

std::string attribute(const std::string& file, const std::string& name, std::size_t points, int width, const char* number) {
  const char* kind = width == 9 ? "Tensor" : width == 3 ? "Vector" : "Scalar";
  return fmt::format("        <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"Node\">{}</Attribute>\n", escaped(field_of(name)), kind,
                     data_item(file, name, points, width, number));
}

}  // namespace

std::string xdmf_grid(const std::string& file, double time, std::size_t points, std::span<const XdmfField> fields) {
  const std::string reference = "reference.h5";
  // The connectivity is explicit because ParaView's default reader shows no cells without it.
  std::string text = fmt::format(
      "      <Grid Name=\"points\" GridType=\"Uniform\">\n        <Time Value=\"{}\"/>\n"
      "        <Topology TopologyType=\"Polyvertex\" NumberOfElements=\"{}\" NodesPerElement=\"1\">{}</Topology>\n"
      "        <Geometry GeometryType=\"XYZ\">{}</Geometry>\n",
      time, points, data_item(reference, "connectivity", points, 1, "Int"), data_item(reference, "position", points, 3, "Float"));
  text += attribute(reference, "id", points, 1, "Int");
  text += attribute(reference, "material_id", points, 1, "Int");
  text += attribute(reference, "volume", points, 1, "Float");
  for (const XdmfField& field : fields) text += attribute(file, field.name, points, field.width, "Float");
  return text + "      </Grid>\n";
}

std::string xdmf_document(const std::string& title, const std::string& version, std::span<const std::string> grids) {
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Xdmf Version=\"3.0\">\n  <Domain>\n"
      "    <Information Name=\"title\" Value=\"{}\"/>\n    <Information Name=\"perikit_version\" Value=\"{}\"/>\n"
      "    <Grid Name=\"frames\" GridType=\"Collection\" CollectionType=\"Temporal\">\n",
      escaped(title), escaped(version));
  for (const std::string& grid : grids) text += grid;
  return text + "    </Grid>\n  </Domain>\n</Xdmf>\n";
}

}  // namespace perikit
