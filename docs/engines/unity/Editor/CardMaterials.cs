using System;
using System.Collections.Generic;
using System.Linq;
using UnityEditor;
using UnityEditor.AssetImporters;
using UnityEngine;
using UnityEngine.Rendering;

namespace Hairloom
{
    /// A pass of the sidecar ("passes_fallback"): which pixels, which side, and what it does to depth.
    public sealed class CardPass
    {
        public string Name;
        public bool IsBack;
        public bool IsBlended;
        public bool WritesDepth;
        public CullMode Cull;
        public int Queue;
    }

    /// The materials of hair cards, one for each pass, as their sidecar has them.
    public static class CardMaterials
    {
        const string Validation =
            "UnityEngine.Rendering.HighDefinition.HDMaterial, Unity.RenderPipelines.HighDefinition.Runtime";

        /// Of a texture [pixels]; Unity's own 2,048 would halve the largest atlas.
        const int MaxSize = 8192;

        /// Opaque pixels, then transparent back faces, then transparent front faces; all after other meshes.
        public static readonly CardPass[] Passes =
        {
            new CardPass { Name = "opaque", WritesDepth = true, Cull = CullMode.Off, Queue = 2460 },
            new CardPass { Name = "back", IsBack = true, IsBlended = true, Cull = CullMode.Front, Queue = 3010 },
            new CardPass { Name = "front", IsBlended = true, WritesDepth = true, Cull = CullMode.Back, Queue = 3011 },
        };

        /// Passes of the shader that opaque pixels have alone.
        static readonly string[] OpaqueModes = { "ShadowCaster", "DepthOnly", "DepthNormalsOnly" };

        public static Material[] Of(Sidecar sidecar, string glb, AssetImportContext context)
        {
            var pipeline = GraphicsSettings.currentRenderPipeline;
            var isHighDefinition = pipeline != null && pipeline.GetType().Name == "HDRenderPipelineAsset";
            var name = isHighDefinition ? "HDRP/Lit" : "Hairloom/Cards";
            var shader = Shader.Find(name)
                ?? throw new CardFileException($"{glb}: the shader {name} is missing; install this package again");
            if (isHighDefinition && !sidecar.textures.HasAlphaInColor)
                context.LogImportWarning(
                    $"{glb}: HDRP/Lit reads alpha with the colour alone, so cards come without gaps between strands; "
                    + "export them again with the packing Unity HDRP");
            var textures = sidecar.textures.Used().ToDictionary(
                each => each.Key, each => Texture(Sidecar.Beside(glb, each.Value.file), context));
            return Passes.Select(pass =>
            {
                var material = new Material(shader) { name = pass.Name, renderQueue = pass.Queue };
                if (isHighDefinition)
                    SetHighDefinition(material, pass, sidecar, textures);
                else
                    SetOwn(material, pass, sidecar, textures, glb, context);
                return material;
            }).ToArray();
        }

        public static IEnumerable<string> TexturePaths(Sidecar sidecar, string glb)
        {
            return sidecar.textures.Used().Concat(Tables(sidecar))
                .Select(each => Sidecar.Beside(glb, each.Value.file));
        }

        /// Values that a shader reads keep their bits: no sRGB, and of tables no compression either. Whether any
        /// of that was otherwise: such a texture is new here, and keeps its size until somebody chooses another one.
        public static bool SetUp(TextureImporter importer, Sidecar sidecar, string file)
        {
            var before = Settings(importer);
            var isTable = Tables(sidecar).Any(each => each.Value.file == file);
            var used = sidecar.textures.Used().Where(each => each.Value.file == file).ToArray();
            if (isTable)
            {
                importer.sRGBTexture = false;
                importer.mipmapEnabled = false;
                importer.npotScale = TextureImporterNPOTScale.None;
                importer.wrapMode = TextureWrapMode.Clamp;
                var platform = importer.GetDefaultPlatformTextureSettings();
                platform.format = TextureImporterFormat.RGBAFloat;
                importer.SetPlatformTextureSettings(platform);
            }
            else if (used.Length > 0)
            {
                importer.sRGBTexture = used[0].Value.color_space == "sRGB";
                importer.alphaIsTransparency = false;
                importer.mipmapEnabled = true;
                var repeats = used.All(each => each.Key == "shift" || each.Key == "noise");
                importer.wrapMode = repeats ? TextureWrapMode.Repeat : TextureWrapMode.Clamp;
            }
            var isNew = !before.SequenceEqual(Settings(importer));
            if (isNew)
                importer.maxTextureSize = MaxSize;
            return isNew;
        }

        static object[] Settings(TextureImporter importer)
        {
            return new object[]
            {
                importer.sRGBTexture, importer.alphaIsTransparency, importer.mipmapEnabled, importer.npotScale,
                importer.wrapMode,
            };
        }

        static Dictionary<string, SidecarTexture> Tables(Sidecar sidecar)
        {
            return sidecar.material?.tables?.All() ?? new Dictionary<string, SidecarTexture>();
        }

        static Texture2D Texture(string path, AssetImportContext context)
        {
            context.DependsOnArtifact(path);
            var texture = AssetDatabase.LoadAssetAtPath<Texture2D>(path);
            if (texture == null)
                context.LogImportWarning($"{path}: this texture of the hair is missing; copy all files of the export");
            return texture;
        }

        static void SetOwn(
            Material material, CardPass pass, Sidecar sidecar, Dictionary<string, Texture2D> textures, string glb,
            AssetImportContext context)
        {
            material.SetFloat("_Cull", (float)pass.Cull);
            material.SetFloat("_ZWrite", pass.WritesDepth ? 1.0f : 0.0f);
            material.SetFloat("_SrcBlend", (float)(pass.IsBlended ? BlendMode.SrcAlpha : BlendMode.One));
            material.SetFloat("_DstBlend", (float)(pass.IsBlended ? BlendMode.OneMinusSrcAlpha : BlendMode.Zero));
            var least = pass.IsBack ? 0.0f : sidecar.min_alpha;
            material.SetFloat("_MinAlpha", pass.IsBlended ? least : sidecar.opaque_alpha);
            material.SetFloat("_MaxAlpha", pass.IsBlended ? sidecar.opaque_alpha : 2.0f);
            foreach (var opaque in OpaqueModes)
                material.SetShaderPassEnabled(opaque, !pass.IsBlended);
            // "color" is for materials that know nothing of hair
            // one that is missing is as one that the export has not
            Func<string, bool> has = role => textures.TryGetValue(role, out var texture) && texture != null;
            foreach (var each in sidecar.textures.Used().Where(each => each.Key != "color" && has(each.Key)))
            {
                material.SetTexture($"_{each.Key}_texture", textures[each.Key]);
                material.SetVector($"_{each.Key}_mask", each.Value.Mask());
            }
            foreach (var each in Tables(sidecar))
                material.SetTexture($"_{each.Key}", Texture(Sidecar.Beside(glb, each.Value.file), context));
            material.SetFloat("_base_gain", has("base") ? sidecar.textures.@base.gain : 1.0f);
            var facing = sidecar.textures.view_compensated_alpha ?? new SidecarFacing();
            material.SetVector("_facing_range", new Vector4(facing.mean_facing, facing.min_facing));
            var hasTangents = sidecar.textures.highlights_by == "tangent" && has("tangent");
            material.SetFloat("_has_tangent_map", hasTangents ? 1.0f : 0.0f);
            var tangent = sidecar.textures.tangent;
            for (var axis = 0; axis < 3 && has("tangent"); axis++)
                material.SetVector($"_tangent_{"xyz"[axis]}", tangent.Lanes(axis));
            var isFlat = has("normal") && sidecar.textures.normal.channels.Length == 2;
            material.SetFloat("_has_normal_map", !has("normal") ? 0.0f : isFlat ? 2.0f : 1.0f);
            material.SetFloat("_has_shift", has("shift") ? 1.0f : 0.0f);
            material.SetFloat("_model", sidecar.material.model == "marschner" ? 1.0f : 0.0f);
            SetAll(material, "_", sidecar.material.values);
            SetAll(material, "_fibre_", sidecar.material.fibre);
        }

        /// The values of the sidecar have the names that the shader has for them.
        static void SetAll(Material material, string before, object values)
        {
            if (values == null)
                return;
            foreach (var field in values.GetType().GetFields())
            {
                var value = field.GetValue(values);
                if (value is float number)
                    material.SetFloat(before + field.Name, number);
                else if (value is float[] lanes && lanes.Length >= 3)
                    material.SetVector(
                        before + field.Name,
                        new Vector4(lanes[0], lanes[1], lanes[2], lanes.Length > 3 ? lanes[3] : 0.0f));
            }
        }

        /// HDRP's own material, in the same passes: its lights can be read by its own shaders alone.
        static void SetHighDefinition(
            Material material, CardPass pass, Sidecar sidecar, Dictionary<string, Texture2D> textures)
        {
            material.SetTexture("_BaseColorMap", textures.TryGetValue("color", out var color) ? color : null);
            material.SetFloat("_Smoothness", 0.5f);
            material.SetFloat("_DoubleSidedEnable", pass.Cull == CullMode.Off ? 1.0f : 0.0f);
            material.SetFloat("_AlphaCutoffEnable", pass.IsBlended ? 0.0f : 1.0f);
            material.SetFloat("_AlphaCutoff", sidecar.opaque_alpha);
            material.SetFloat("_SurfaceType", pass.IsBlended ? 1.0f : 0.0f);
            material.SetFloat("_TransparentCullMode", (float)(pass.IsBack ? CullMode.Front : CullMode.Back));
            material.SetFloat("_TransparentZWrite", pass.WritesDepth ? 1.0f : 0.0f);
            material.SetFloat("_TransparentSortPriority", pass.IsBack ? 0.0f : 1.0f);
            // HDRP turns the values into keywords; its assembly is not there in other projects
            var validation = Type.GetType(Validation)?.GetMethod("ValidateMaterial", new[] { typeof(Material) });
            validation?.Invoke(null, new object[] { material });
        }
    }
}
