using System.IO;
using System.Linq;
using UnityEditor;
using UnityEditor.AssetImporters;
using UnityEngine;
using UnityEngine.Rendering;

namespace Hairloom
{
    /// Imports a GLB of Hairloom as a prefab: its levels in a LOD group, in the order of the file, with
    /// the materials of its sidecar. A GLB without a sidecar stays with whatever imports it otherwise.
    [ScriptedImporter(2, new string[0], new[] { "glb" })]
    public sealed class CardImporter : ScriptedImporter
    {
        [Tooltip("Of each level's range, the part in which the next one is drawn too, each in its own pixels; 0: "
            + "levels change at once. It needs LOD Cross Fade in the asset of the render pipeline")]
        [Range(0, 1)]
        public float crossFade = 0.1f;

        public override void OnImportAsset(AssetImportContext context)
        {
            try
            {
                Import(context, context.assetPath, crossFade);
            }
            catch (CardFileException error)
            {
                context.LogImportError(error.Message);
            }
        }

        static void Import(AssetImportContext context, string path, float crossFade)
        {
            var sidecar = Sidecar.Of(path);
            context.DependsOnSourceAsset(Sidecar.PathOf(path));
            if (!string.IsNullOrEmpty(sidecar.index_buffer?.file))
                context.DependsOnSourceAsset(Sidecar.Beside(path, sidecar.index_buffer.file));
            if (sidecar.file != Path.GetFileName(path))
                context.LogImportWarning(
                    $"{Sidecar.PathOf(path)}: it names {sidecar.file}; rename both files back if the hair looks wrong");
            var levels = CardLevel.All(path, sidecar, text => context.LogImportWarning(text));
            var materials = CardMaterials.Of(sidecar, path, context);
            var root = new GameObject(Path.GetFileNameWithoutExtension(path));
            context.AddObjectToAsset("root", root);
            context.SetMainObject(root);
            foreach (var material in materials)
                context.AddObjectToAsset(material.name, material);
            var shown = levels.Select(level => Shown(level, root, materials, context)).ToArray();
            var last = levels.Length - 1;
            var lods = levels.Select((level, i) => new LOD(level.EndHeight, new Renderer[] { shown[i] })
            {
                fadeTransitionWidth = i < last ? crossFade : 0.0f,
            });
            var group = root.AddComponent<LODGroup>();
            group.fadeMode = crossFade > 0.0f ? LODFadeMode.CrossFade : LODFadeMode.None;
            group.SetLODs(lods.ToArray());
            group.RecalculateBounds();
        }

        /// One part of the mesh for each pass: a part is drawn whole, in its order, before the next.
        static MeshRenderer Shown(CardLevel level, GameObject root, Material[] materials, AssetImportContext context)
        {
            var mesh = new Mesh
            {
                name = level.Name,
                indexFormat = level.Positions.Length > 65535 ? IndexFormat.UInt32 : IndexFormat.UInt16,
                vertices = level.Positions,
                normals = level.Normals,
                tangents = level.Tangents,
                uv = level.Places,
                uv2 = level.Occlusion,
                subMeshCount = CardMaterials.Passes.Length,
            };
            for (var number = 0; number < CardMaterials.Passes.Length; number++)
                mesh.SetTriangles(CardMaterials.Passes[number].IsBack ? level.Back : level.Front, number);
            mesh.RecalculateBounds();
            context.AddObjectToAsset(level.Name, mesh);
            var child = new GameObject(level.Name);
            child.transform.SetParent(root.transform, false);
            child.AddComponent<MeshFilter>().sharedMesh = mesh;
            var renderer = child.AddComponent<MeshRenderer>();
            renderer.sharedMaterials = materials;
            return renderer;
        }

        /// Textures come before the hair that shows them.
        static string[] GatherDependenciesFromSourceFile(string path)
        {
            try
            {
                return CardMaterials.TexturePaths(Sidecar.Of(path), path).ToArray();
            }
            catch (CardFileException)
            {
                return new string[0];  // OnImportAsset says what is wrong
            }
        }
    }

    /// Chooses the importer of a GLB that has a sidecar, and how its textures are read.
    public sealed class CardPostprocessor : AssetPostprocessor
    {
        static void OnPostprocessAllAssets(string[] imported, string[] deleted, string[] moved, string[] movedFrom)
        {
            foreach (var glb in imported.Concat(moved).Select(Sidecar.GlbOf).Distinct().Where(Sidecar.IsBeside))
            {
                if (AssetDatabase.GetImporterOverride(glb) != typeof(CardImporter))
                    AssetDatabase.SetImporterOverride<CardImporter>(glb);
                SetUpTextures(glb);
            }
        }

        /// Those that came before their sidecar have been imported as any others.
        static void SetUpTextures(string glb)
        {
            try
            {
                var sidecar = Sidecar.Of(glb);
                foreach (var path in CardMaterials.TexturePaths(sidecar, glb).Distinct())
                    if (AssetImporter.GetAtPath(path) is TextureImporter importer
                        && CardMaterials.SetUp(importer, sidecar, Path.GetFileName(path)))
                        importer.SaveAndReimport();
            }
            catch (CardFileException)
            {
                return;  // the importer of the GLB says what is wrong
            }
        }

        void OnPreprocessTexture()
        {
            var folder = Path.GetDirectoryName(assetPath) ?? "";
            foreach (var glb in Directory.GetFiles(folder, "*.glb").Where(Sidecar.IsBeside))
            {
                try
                {
                    var file = Path.GetFileName(assetPath);
                    CardMaterials.SetUp((TextureImporter)assetImporter, Sidecar.Of(glb), file);
                }
                catch (CardFileException)
                {
                    continue;  // the importer of the GLB says what is wrong
                }
            }
        }
    }
}
