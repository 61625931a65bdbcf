// Meshes of problem files: embedded, or in OBJ files of their own.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "energymargin/metrics/effort.hpp"
#include "expect.hpp"
#include "problem_files.hpp"

namespace energymargin {
namespace {

using namespace scenes;
using Json = nlohmann::ordered_json;

// Two mugs on a table that do not touch, and one of them hangs in the air.
Problem mugs() {
  Scene scene;
  scene.add_body(fixed("table", Plane{}));
  scene.add_body(body("mug", mug(), 0.3, {0.0, 0.0, 0.026}, Role::object));
  scene.add_body(body("../o\xc3\xb6/mug", mug(), 0.2, {1.0, 0.0, 0.5}, Role::object));
  scene.add_body(body(".._o__/mug", mug(), 0.2, {2.0, 0.0, 0.5}));
  return problem_of(scene, {1.0, 1.0, 1.0}, Vector3::Zero(), 0.1, regions::Ball{"mug", {0.0, 0.0, 0.026}, 0.02});
}

// The text of mugs with another shape for the first one.
std::string with_shape(const Json& shape) {
  Json json = Json::parse(to_json(mugs()));
  json["scene"]["bodies"][1]["shape"] = shape;
  return json.dump();
}

std::string with_mesh(const std::string& file) { return with_shape({{"type", "mesh"}, {"file", file}}); }

constexpr const char* corner = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";

TEST(ProblemIoMesh, FilesOfMeshesStandBesideTheProblemUnderNamesThatAFolderBears) {
  const Folder folder;
  save(mugs(), folder / "two mugs.json", Meshes::files);
  const Json bodies = Json::parse(folder.read("two mugs.json"))["scene"]["bodies"];
  EXPECT_EQ(bodies[1]["shape"]["type"], "mesh");
  EXPECT_EQ(bodies[1]["shape"]["file"], "two mugs-mug.obj");
  EXPECT_EQ(bodies[2]["shape"]["file"], "two mugs-.._o___mug.obj");
  EXPECT_EQ(bodies[3]["shape"]["file"], "two mugs-.._o___mug-2.obj");
  for (int i = 1; i < 4; ++i) EXPECT_TRUE(std::filesystem::exists(folder / bodies[i]["shape"]["file"]));
}

TEST(ProblemIoMesh, ScoresHaveTheSameBitsWithEmbeddedAndWithSeparateMeshes) {
  const Folder folder;
  const Problem given = mugs();
  save(given, folder / "embedded.json");
  save(given, folder / "files.json", Meshes::files);
  const Problem embedded = load(folder / "embedded.json");
  const Problem files = load(folder / "files.json");
  EXPECT_EQ(to_json(files), to_json(given));
  const Tree tree = escape_effort(given, {"est", 60, 3}).tree;
  EXPECT_TRUE(same_bits(escape_effort(embedded, {"est", 60, 3}).tree, tree));
  EXPECT_TRUE(same_bits(escape_effort(files, {"est", 60, 3}).tree, tree));
}

TEST(ProblemIoMesh, CompoundThatAnObjFileCannotHoldStaysInTheProblemFile) {
  const Folder folder;
  save(everything(), folder / "all.json", Meshes::files);
  const Json bodies = Json::parse(folder.read("all.json"))["scene"]["bodies"];
  EXPECT_EQ(bodies[6]["shape"]["type"], "mesh");      // hulls alone
  EXPECT_EQ(bodies[7]["shape"]["type"], "compound");  // a capsule, and a hull that is moved
  EXPECT_EQ(bodies[8]["shape"]["type"], "compound");  // no parts
  EXPECT_EQ(to_json(load(folder / "all.json")), to_json(everything()));
}

TEST(ProblemIoMesh, FacesOfAWrittenMeshCloseEachPartAndPointOutward) {
  const Folder folder;
  save(mugs(), folder / "p.json", Meshes::files);
  std::istringstream lines(folder.read("p-mug.obj"));
  std::vector<Vector3> points;
  double six_volumes = 0.0;
  int faces = 0;
  for (std::string word; lines >> word;) {
    if (word == "v") {
      points.emplace_back();
      lines >> points.back().x() >> points.back().y() >> points.back().z();
    } else if (word == "f") {
      std::size_t a = 0, b = 0, c = 0;
      lines >> a >> b >> c;
      six_volumes += points[a - 1].dot(points[b - 1].cross(points[c - 1]));
      ++faces;
    }
  }
  EXPECT_EQ(points.size(), 24u);
  EXPECT_EQ(faces, 36);
  EXPECT_NEAR(six_volumes / 6.0, 3.0 * 0.05 * 0.06 * 0.07, 1e-15);
}

TEST(ProblemIoMesh, ObjOfOtherToolsIsReadForItsPoints) {
  const Folder folder;
  folder.write("cup.obj", std::string("# a cup\r\nmtllib cup.mtl\r\n\r\no part one\r\n") + corner +
                              "vn 0 0 1\nvt 0 0\nusemtl red\ns off\nf 1//1 2//1 3//1\no two\n" + corner);
  const Shape shape = load(folder.write("p.json", with_mesh("cup.obj"))).scene.body("mug").shape;
  const auto& cup = std::get<Compound>(shape);
  ASSERT_EQ(cup.parts.size(), 2u);
  EXPECT_EQ(std::get<ConvexHull>(cup.parts[0].shape).points,
            (std::vector<Vector3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}));
  EXPECT_FALSE(cup.solid);
}

TEST(ProblemIoMesh, PathIsRelativeToTheProblemFileOrAbsolute) {
  const Folder folder;
  std::filesystem::create_directories(folder / "meshes");
  const std::string mesh = folder.write("meshes/cup.obj", std::string("o cup\n") + corner);
  EXPECT_NO_THROW(load(folder.write("p.json", with_mesh("meshes/cup.obj"))));
  EXPECT_NO_THROW(load(folder.write("meshes/p.json", with_mesh("../meshes/cup.obj"))));
  EXPECT_NO_THROW(from_json(with_mesh(mesh)));
  EXPECT_NO_THROW(from_json(with_mesh("cup.obj"), folder / "meshes"));
  EXPECT_TRUE(rejects([] { from_json(with_mesh("cup.obj")); },
                      {"scene.bodies[1].shape.file", "\"cup.obj\"", "an absolute path, or the folder"}));
}

TEST(ProblemIoMesh, SolidOfAMeshIsReadFromTheProblemFile) {
  const Folder folder;
  folder.write("cup.obj", std::string("o cup\n") + corner);
  const Json solid = {
      {"volume", 0.5}, {"center", {0.1, 0.2, 0.3}}, {"moments", {1.0, 1.1, 1.2}}, {"axes", {0.0, 0.0, 0.0, 1.0}}};
  const Problem read = from_json(with_shape({{"type", "mesh"}, {"file", "cup.obj"}, {"solid", solid}}), folder / "");
  EXPECT_EQ(read.scene.body("mug").principal_inertial().center, Vector3(0.1, 0.2, 0.3));
}

TEST(ProblemIoMesh, MeshThatIsNoneIsRejectedByItsNameAndLine) {
  const Folder folder;
  const auto loading = [&](const std::string& mesh) {
    folder.write("cup.obj", mesh);
    return [&] { load(folder.write("p.json", with_mesh("cup.obj"))); };
  };
  const std::string good = std::string("o cup\n") + corner;
  const std::string file = folder / "cup.obj";
  EXPECT_TRUE(rejects(loading(""), {"scene.bodies[1].shape.file", file, "no convex part", "\"o name\""}));
  EXPECT_TRUE(rejects(loading(corner), {file, "line 1", "\"v 0 0 0\"", "\"o name\""}));
  EXPECT_TRUE(rejects(loading("o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\n"), {file, "part \"a\" of line 1", "3 points", "4"}));
  EXPECT_TRUE(rejects(loading(good + "o lid\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n"), {"\"lid\" of line 6", "flat"}));
  for (const char* numbers : {"0 0 nan", "0 0 inf", "0 0 1e999", "0 0", "0 0 0 1", "0 0 x", "0 0 0x", ""}) {
    EXPECT_TRUE(rejects(loading(good + "v " + numbers + "\n"), {file, "line 6", "three finite numbers"})) << numbers;
  }
  EXPECT_TRUE(rejects(loading("g cup\n"), {file, "line 1", "\"g cup\"", "o, v"}));
  EXPECT_TRUE(rejects(loading(good + "f " + std::string(5000, '1')), {file, "line 6", "4096 characters"}));
  EXPECT_TRUE(rejects(loading(std::string("\x7f\0\xff\xfe", 4)), {file, "line 1", "\\u0000"}));
}

TEST(ProblemIoMesh, MeshThatCannotBeOpenedIsRejectedByItsName) {
  const Folder folder;
  std::filesystem::create_directories(folder / "folder");
  const auto loading = [&](const std::string& file) {
    return [&folder, file] { load(folder.write("p.json", with_mesh(file))); };
  };
  EXPECT_TRUE(
      rejects(loading("cup.obj"), {"p.json", "scene.bodies[1].shape.file", folder / "cup.obj", "No such file"}));
  EXPECT_TRUE(rejects(loading("folder"), {folder / "folder", "Is a directory"}));
  EXPECT_TRUE(rejects(loading(""), {"scene.bodies[1].shape.file is \"\"", "path of an OBJ file"}));
}

TEST(ProblemIoMesh, DevicesAndPipesWhichMayHaveNoEndAreNotReadAsMeshes) {
  const Folder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  EXPECT_TRUE(rejects([&] { from_json(with_mesh("pipe"), folder / ""); }, {"scene.bodies[1].shape.file", "a pipe"}));
  EXPECT_TRUE(rejects([] { from_json(with_mesh("/dev/zero")); }, {"\"/dev/zero\"", "a device"}));
}

TEST(ProblemIoMesh, PathWithAZeroByteIsNotThatOfTheFileBeforeIt) {
  const Folder folder;
  folder.write("cup.obj", std::string("o cup\n") + corner);
  const std::string path("cup.obj\0.txt", 12);
  EXPECT_TRUE(rejects([&] { from_json(with_mesh(path), folder / ""); }, {"cup.obj\\u0000.txt", "path of an OBJ"}));
}

}  // namespace
}  // namespace energymargin
