/* mesh_import.h: triangle meshes through assimp. */
#ifndef TOILE_SCENE_MESH_IMPORT_H
#define TOILE_SCENE_MESH_IMPORT_H

const char *mesh_import_version(void); /* "assimp 5.2.4" */

#endif
