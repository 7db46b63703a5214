// Imports a GLB, calling the package as Unity does, and prints the result as JSON.
using System;
using System.Collections.Generic;
using System.IO;
using System.Linq;
using System.Reflection;
using System.Web.Script.Serialization;
using Hairloom;
using UnityEditor;
using UnityEditor.AssetImporters;
using UnityEngine;

public static class Imported
{
    public static int Main(string[] arguments)
    {
        var path = arguments[0];
        Shader.Known.Add("Hairloom/Cards");
        if (arguments.Contains("hdrp"))
        {
            Shader.Known.Add("HDRP/Lit");
            UnityEngine.Rendering.GraphicsSettings.currentRenderPipeline =
                new UnityEngine.Rendering.HDRenderPipelineAsset();
        }
        var before = (string[])Call(typeof(CardImporter), null, "GatherDependenciesFromSourceFile", path);
        foreach (var texture in before.Where(File.Exists))  // imported before their sidecar existed
            AssetImporter.Known[texture] = new TextureImporter { assetPath = texture };
        foreach (var each in new[] { path, Sidecar.PathOf(path) })
            Call(typeof(CardPostprocessor), null, "OnPostprocessAllAssets", new[] { each }, new string[0], new string[0], new string[0]);
        var context = new AssetImportContext { assetPath = path };
        var importer = new CardImporter();
        if (arguments.Contains("at_once"))
            importer.crossFade = 0;
        importer.OnImportAsset(context);
        var group = (context.Main as GameObject)?.components.OfType<LODGroup>().Single();
        var found = new Dictionary<string, object>
        {
            ["importer"] = AssetDatabase.GetImporterOverride(path)?.Name,
            ["before"] = before,
            ["sources"] = context.Sources.Select(Path.GetFileName).ToArray(),
            ["reimported"] = AssetImporter.Reimported.Select(Path.GetFileName).ToArray(),
            ["errors"] = context.Errors,
            ["warnings"] = context.Warnings,
            ["meshes"] = context.Assets.OfType<Mesh>().Select(Told).ToArray(),
            ["materials"] = context.Assets.OfType<Material>().Select(Told).ToArray(),
            ["heights"] = group?.lods.Select(lod => lod.screenRelativeTransitionHeight).ToArray(),
            ["fade"] = group?.fadeMode.ToString(),
            ["fades"] = group?.lods.Select(lod => lod.fadeTransitionWidth).ToArray(),
            ["textures"] = before.Distinct().Where(File.Exists).ToDictionary(Path.GetFileName, SetUp),
        };
        Console.WriteLine(new JavaScriptSerializer { MaxJsonLength = int.MaxValue }.Serialize(found));
        return 0;
    }

    static object Told(Mesh mesh)
    {
        return new Dictionary<string, object>
        {
            ["name"] = mesh.name,
            ["positions"] = mesh.vertices.SelectMany(v => new[] { v.x, v.y, v.z }).ToArray(),
            ["normals"] = mesh.normals.SelectMany(v => new[] { v.x, v.y, v.z }).ToArray(),
            ["tangents"] = mesh.tangents.SelectMany(v => new[] { v.x, v.y, v.z }).ToArray(),
            ["uv"] = mesh.uv.SelectMany(v => new[] { v.x, v.y }).ToArray(),
            ["along"] = mesh.uv2.Select(v => v.y).ToArray(),
            ["parts"] = mesh.Parts.OrderBy(part => part.Key).Select(part => part.Value).ToArray(),
        };
    }

    static object Told(Material material)
    {
        return new Dictionary<string, object>
        {
            ["name"] = material.name,
            ["shader"] = material.shader.name,
            ["queue"] = material.renderQueue,
            ["values"] = material.Values,
        };
    }

    static object SetUp(string path)
    {
        var importer = new TextureImporter { assetPath = path };
        var postprocessor = new CardPostprocessor { assetPath = path, assetImporter = importer };
        Call(typeof(CardPostprocessor), postprocessor, "OnPreprocessTexture");
        return new Dictionary<string, object>
        {
            ["sRGB"] = importer.sRGBTexture,
            ["size"] = importer.maxTextureSize,
            ["mipmaps"] = importer.mipmapEnabled,
            ["wrap"] = importer.wrapMode.ToString(),
            ["format"] = importer.platform.format.ToString(),
        };
    }

    /// Unity finds these by their names.
    static object Call(Type type, object self, string name, params object[] arguments)
    {
        const BindingFlags All =
            BindingFlags.Static | BindingFlags.Instance | BindingFlags.NonPublic | BindingFlags.Public;
        return type.GetMethod(name, All).Invoke(self, arguments);
    }
}
