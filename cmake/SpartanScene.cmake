# The scripts that draw terrain in 3D, put into the module figures: three.js of Debian (libjs-three) and scene.js. Without
# three.js reports have no map in 3D, and there is no `spartan view`.
include(SpartanEmbedded)
find_file(SPARTAN_THREE three/three.min.js PATHS /usr/share/javascript)
find_path(SPARTAN_THREE_EXAMPLES controls/OrbitControls.js PATHS /usr/share/javascript/three/examples/js)
set(scene_files)
if(SPARTAN_THREE AND SPARTAN_THREE_EXAMPLES)
  set(SPARTAN_HAS_THREE ON)
  set(scene_files "/three/notice.js=${PROJECT_SOURCE_DIR}/src/spartan/figures/three_notice.js" "/three.min.js=${SPARTAN_THREE}")
  # Controls of the camera, and lines that are wider than a pixel.
  foreach(part IN ITEMS controls/OrbitControls lines/LineSegmentsGeometry lines/LineGeometry lines/LineMaterial
      lines/LineSegments2 lines/Line2)
    list(APPEND scene_files "/three/${part}.js=${SPARTAN_THREE_EXAMPLES}/${part}.js")
  endforeach()
  list(APPEND scene_files "/scene.js=${PROJECT_SOURCE_DIR}/src/spartan/figures/scene.js")
endif()
spartan_embed(spartan_figures FUNCTION spartan::internal::scene_files FILES ${scene_files})
